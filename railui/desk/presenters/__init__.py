"""Texts, tables and plots that the panels show."""
