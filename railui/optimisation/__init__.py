"""Optimisation studies: design space, objectives, search."""
