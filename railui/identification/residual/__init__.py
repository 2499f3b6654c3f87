"""Residual of a model: its noise, and the evidence that it is no noise."""
