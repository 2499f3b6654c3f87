"""Vehicles simulated by Exudyn: a multibody program by other hands, against which motions and loops are checked."""
