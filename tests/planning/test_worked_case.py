"""The worked case of docs/plan.md says what the two loops say."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.planning.worked_case import PLANNED, USUAL, identify

PAGE = (Path(__file__).parents[2] / "docs/plan.md").read_text()


@pytest.mark.slow
def test_the_usual_campaign_finds_nothing_and_the_planned_one_the_effect() -> None:
    usual, planned = identify(USUAL), identify(PLANNED)
    assert (usual[0], planned[0]) == ("none", "effect")
    quoted = " ".join(PAGE.split())
    assert usual[1] in quoted and planned[1] in quoted
