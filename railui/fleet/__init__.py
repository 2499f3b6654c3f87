"""Fleets: many vehicles over months of runs, and changes found before they reach a limit."""
