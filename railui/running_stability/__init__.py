"""Stability: modes, critical speeds, limit cycles."""
