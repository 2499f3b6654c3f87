"""Reports: results as data, files and pages."""
