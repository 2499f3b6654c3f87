"""Readers against what nobody should write."""
