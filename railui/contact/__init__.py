"""Wheel-rail contact: from measured profiles to the parameters of the model."""
