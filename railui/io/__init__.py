"""Files: YAML with marks, tables, units, numbers, atomic writing, problems with file, line and remedy."""
