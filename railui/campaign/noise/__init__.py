"""Noise of the columns of a campaign: level and colour, estimated with the stated noise as prior."""
