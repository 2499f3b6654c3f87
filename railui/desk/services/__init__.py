"""Services of the desk: background jobs, files, recording."""
