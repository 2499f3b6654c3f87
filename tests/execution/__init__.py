"""Tests of searches that are interrupted, resumed and distributed."""
