"""Only the desk imports Textual and Rich."""

from __future__ import annotations

import subprocess
import sys

IMPORT_ALL = """
import importlib, pkgutil, sys, railui
for module in pkgutil.walk_packages(railui.__path__, "railui."):
    if not module.name.startswith("railui.desk") and module.name != "railui.__main__":
        importlib.import_module(module.name)
print([name for name in sys.modules if name.split(".")[0] in ("textual", "textual_plot", "rich")])
"""


def test_only_the_desk_imports_textual() -> None:
    process = subprocess.run([sys.executable, "-c", IMPORT_ALL], capture_output=True, text=True, check=True)
    assert process.stdout.strip() == "[]"
