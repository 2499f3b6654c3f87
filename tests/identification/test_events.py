"""Whoever watches a study sees how it goes, and can stop it."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.events import FitIteration, ModelValidated, ScoreTestProgress
from railui.identification.loop import close_loop
from railui.identification.structure.score_test import ScoreTestResult
from railui.progress import Stopped

CAMPAIGN = Path(__file__).parents[2] / "designs/campaigns/worn_axle_box"


def watched(until: type) -> list[object]:
    """The events of a loop on the bundled campaign up to the first of a kind, at which it is stopped."""
    seen: list[object] = []

    def watch(event: object) -> None:
        seen.append(event)
        if isinstance(event, until):
            raise Stopped

    with pytest.raises(Stopped):
        close_loop(read_dataset(load_campaign(CAMPAIGN)), watch=watch)
    return seen


def test_a_loop_shows_its_errors_its_steps_and_its_trace_and_stops_when_told() -> None:
    seen = watched(ScoreTestResult)
    turns = [e for e in seen if isinstance(e, FitIteration)]
    before = next(e for e in seen if isinstance(e, ModelValidated) and e.stage == "before")
    declared = next(e for e in seen if isinstance(e, ModelValidated) and e.stage == "declared")
    assert before.validation.nrmse < declared.validation.nrmse
    assert turns[-1].channels["e1"] < turns[0].channels["e1"]
    # at the optimum what remains is orthogonal to what the parameters can do
    assert max(abs(turns[-1].rho[:5])) < 0.01 < 0.1 < max(abs(turns[0].rho[:5]))
    done = [(e.done, e.total) for e in seen if isinstance(e, ScoreTestProgress)]
    # a first look at all on short stretches, then one at the best on long ones; each counts up to its total
    glimpse, whole = done[0][1], done[-1][1]
    assert whole < glimpse
    assert done == [*((i, glimpse) for i in range(1, glimpse + 1)), *((i, whole) for i in range(1, whole + 1))]
