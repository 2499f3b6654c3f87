"""Parameter estimation by output error, and its validation."""
