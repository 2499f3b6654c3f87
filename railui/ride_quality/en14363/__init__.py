"""Evaluation of runs by the rules of EN 14363: test zones, track sections, percentiles, estimated maxima, limits."""
