"""Report of the plan of a measurement campaign."""
