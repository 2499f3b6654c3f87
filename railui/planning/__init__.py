"""Design of measurement campaigns: which sensors and runs would detect which effects and determine which parameters."""
