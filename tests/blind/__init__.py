"""Campaigns drawn blind and traced: how often the loop names what was planted."""
