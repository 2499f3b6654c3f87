"""The version is stated once, in Cargo.toml, and the changelog describes it."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
VERSION = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]


def test_packages_and_crates_take_their_version_from_the_workspace() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert "version" not in project and project["dynamic"] == ["version"]
    for manifest in ("rust_core/Cargo.toml", "rust_core/fmu/Cargo.toml", "rust_core/python/Cargo.toml"):
        assert tomllib.loads((ROOT / manifest).read_text())["package"]["version"] == {"workspace": True}


def test_the_lock_of_the_crates_names_the_version() -> None:
    crates = tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]
    own = {crate["name"]: crate["version"] for crate in crates if crate["name"].startswith("railui_")}
    assert own == {"railui_core": VERSION, "railui_fmu": VERSION, "railui_python": VERSION}


def test_the_changelog_begins_with_the_version() -> None:
    headings = re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert headings[0] == VERSION
