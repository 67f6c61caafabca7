"""Metrics on motions, comparisons with ground truth, and the ledger of claims."""
