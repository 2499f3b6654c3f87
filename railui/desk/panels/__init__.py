"""The panels of the desk, one for each part of a day's work."""
