"""Quasi-static curves."""

from railui.curving.evaluation import curve, curve_many, curves

__all__ = ["curve", "curve_many", "curves"]
