"""Installation of optional dependencies."""

from __future__ import annotations


def install_extra(name: str) -> str:
    """Return the command that installs a group of optional dependencies, named as in pyproject.toml."""
    return f"python -m pip install '.[{name}]' in the checkout"
