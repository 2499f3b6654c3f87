"""Presenters: texts, bar rows and plot data of the panels, without widgets."""
