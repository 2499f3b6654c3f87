"""Outputs in README and docs agree with those of the commands."""
