"""Measurement campaigns: runs with their roles, datasets, data checks."""
