"""Widgets: plots, forms, bars, dialogs."""
