"""Readers on damaged and random input."""
