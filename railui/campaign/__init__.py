"""Measurement campaigns: runs with their roles, datasets, comparison, data checks."""
