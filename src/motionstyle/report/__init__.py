"""The page that shows a run: clips, figures and the ledger, in one file that works offline."""
