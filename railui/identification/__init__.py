"""Identification of unmodelled effects from measured motions."""
