"""Searches that are killed, resumed and spread."""
