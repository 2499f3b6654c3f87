"""Version of the installed package, stated in Cargo.toml."""

from importlib.metadata import version

__version__ = version("railui")
