"""The report of a loop."""
