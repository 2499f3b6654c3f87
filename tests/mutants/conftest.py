"""Modules that import mutmut, which only `make mutants` installs, are not collected for their docstrings."""

collect_ignore = ["mutants.py", "__main__.py"]
