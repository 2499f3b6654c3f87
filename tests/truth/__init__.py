"""Independent implementation of the equations in plain numpy, and campaigns simulated with it."""
