"""The headless parts of railui never read Textual."""

from __future__ import annotations

import subprocess
import sys

READ_ALL = """
import importlib, pkgutil, sys, railui
for found in pkgutil.walk_packages(railui.__path__, "railui."):
    if not found.name.startswith("railui.desk") and found.name != "railui.__main__":
        importlib.import_module(found.name)
print([name for name in sys.modules if name.split(".")[0] in ("textual", "textual_plot", "rich")])
"""


def test_no_module_beside_the_desk_reads_textual() -> None:
    told = subprocess.run([sys.executable, "-c", READ_ALL], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"
