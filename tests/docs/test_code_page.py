"""docs/code.md: its paths exist, and its figure shows the present layers and imports."""

from __future__ import annotations

import importlib.util
import re

from tests.docs.transcript import ROOT

PAGE = (ROOT / "docs/code.md").read_text()


def test_every_path_on_the_page_exists() -> None:
    paths = set(re.findall(r"`((?:railui|rust_core|docs|tests)/[\w/.]*)`", PAGE))
    assert len(paths) > 30
    assert sorted(path for path in paths if not (ROOT / path).exists()) == []


def test_the_figure_shows_the_present_layers_and_imports() -> None:
    spec = importlib.util.spec_from_file_location("layers", ROOT / "docs/layers.py")
    assert spec is not None and spec.loader is not None
    layers = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(layers)
    picture = (ROOT / "docs/layers.svg").read_text()
    assert f"<dc:description>{layers.edges()}</dc:description>" in picture, "run python docs/layers.py"
    assert all(f">{name}<" in picture for row in layers.layers() for name in row)
