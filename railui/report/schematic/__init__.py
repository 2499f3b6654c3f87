"""Schematic drawing of a vehicle: plan view with suspension, sensors and locations of effects."""
