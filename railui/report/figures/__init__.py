"""Figures of the command line and the documentation."""
