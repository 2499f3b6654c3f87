"""The serial protocol: frames, fields, text lines, link."""
