"""Serial protocol: frames, fields, text lines, link, line load."""
