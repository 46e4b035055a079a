"""Surrogates of the discrepancy and of the signal."""
