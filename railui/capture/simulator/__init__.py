"""Simulated logger: faults, sensors of a simulated run, pseudo-terminal."""
