"""Recording of a serial link to run files."""
