"""The citation file is valid and states the present version."""

from __future__ import annotations

import yaml

import railui
from tests.docs.transcript import ROOT


def test_the_citation_states_the_version_and_the_thesis() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert citation["version"] == railui.__version__
    assert {"cff-version", "message", "title", "authors", "license"} <= set(citation)
    assert citation["references"][0]["year"] == 1976
