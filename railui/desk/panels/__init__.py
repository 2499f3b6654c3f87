"""Panels of the desk."""
