"""Front of the package: the objects and functions that `railui` exports; the commands use the same functions."""
