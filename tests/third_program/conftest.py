"""Modules that import Exudyn, which need not be installed, are not collected for their docstrings without it."""

from importlib.util import find_spec
from pathlib import Path

if find_spec("exudyn") is None:
    here = Path(__file__).parent
    collect_ignore = [
        path.name for path in here.glob("*.py") if not path.name.startswith(("test_", "__init__", "conf"))
    ]
