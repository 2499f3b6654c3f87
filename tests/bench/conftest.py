"""Peers import what only their own environment has."""

collect_ignore = ["peers"]
