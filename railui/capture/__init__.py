"""Field data: from the bytes of a serial logger to a measured campaign."""
