"""Inverse dynamics of the body with contact, passive and shoe forces; generated code."""
