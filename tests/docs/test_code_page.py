"""The page of the code: its paths exist, and its picture shows the layers and imports of today."""

from __future__ import annotations

import importlib.util
import re

from tests.docs.transcript import ROOT

PAGE = (ROOT / "docs/code.md").read_text()


def test_every_path_of_the_page_of_the_code_exists() -> None:
    paths = set(re.findall(r"`((?:railui|rust_core|docs|tests)/[\w/.]*)`", PAGE))
    assert len(paths) > 30
    assert sorted(path for path in paths if not (ROOT / path).exists()) == []


def test_the_picture_of_the_layers_shows_the_imports_of_today() -> None:
    spec = importlib.util.spec_from_file_location("layers", ROOT / "docs/layers.py")
    assert spec is not None and spec.loader is not None
    layers = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(layers)
    picture = (ROOT / "docs/layers.svg").read_text()
    assert f"<dc:description>{layers.edges()}</dc:description>" in picture, "run python docs/layers.py"
    assert all(f">{name}<" in picture for row in layers.layers() for name in row)
