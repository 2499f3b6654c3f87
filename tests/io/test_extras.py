"""Names of optional dependencies in messages."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from railui.io.extras import install_extra

ROOT = Path(__file__).parents[2]


def test_every_named_group_is_one_of_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    sources = "".join(p.read_text("utf-8") for p in sorted((ROOT / "railui").rglob("*.py")))
    named = set(re.findall(r"""install_extra\(["'](\w+)["']\)""", sources))
    assert named
    assert named <= set(project["optional-dependencies"])


def test_the_command_installs_from_the_checkout() -> None:
    assert install_extra("frames") == "python -m pip install '.[frames]' in the checkout"
