"""The report of an optimisation study."""
