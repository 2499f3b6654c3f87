"""A simulated logger."""
