"""Widgets: plots, forms, dialogs, bars."""
