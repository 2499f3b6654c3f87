"""Background work, recordings, ports, files."""
