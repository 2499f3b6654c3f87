"""Discrepancies that no effect of the library explains."""
