"""Pages for contributors: their paths exist, and the figure of docs/code.md shows the present layers and imports."""

from __future__ import annotations

import importlib.util
import re

import pytest

from tests.docs.transcript import ROOT

LEAST_PATHS = {"docs/code.md": 30, "docs/new_effect.md": 5, "CONTRIBUTING.md": 4}  # of each page


@pytest.mark.parametrize("page", LEAST_PATHS)
def test_every_path_on_a_page_for_contributors_exists(page: str) -> None:
    paths = set(re.findall(r"`((?:railui|rust_core|docs|tests)/[\w/.]*)`", (ROOT / page).read_text()))
    paths.discard("rust_core/src/effects/NAME.rs")
    assert len(paths) > LEAST_PATHS[page]
    assert sorted(path for path in paths if not (ROOT / path).exists()) == []


def test_the_figure_shows_the_present_layers_and_imports() -> None:
    spec = importlib.util.spec_from_file_location("layers", ROOT / "docs/layers.py")
    assert spec is not None and spec.loader is not None
    layers = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(layers)
    picture = (ROOT / "docs/layers.svg").read_text()
    assert f"<dc:description>{layers.edges()}</dc:description>" in picture, "run python docs/layers.py"
    assert all(f">{name}<" in picture for row in layers.layers() for name in row)
