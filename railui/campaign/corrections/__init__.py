"""Corrections of measured columns: their keys in a campaign file, and their application to a run."""
