"""Measured runs: columns, units, segments."""
