"""Progress of the loop: its events, and stopping it."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.events import FitIteration, ModelValidated, ScoreTestProgress
from railui.identification.loop import close_loop
from railui.identification.structure.score_test import ScoreTestResult
from railui.progress import Progress, Stopped

CAMPAIGN = Path(__file__).parents[2] / "designs/campaigns/worn_axle_box"


def events_until(until: type) -> list[object]:
    """Collect the events of a loop on the bundled campaign up to the first of a kind, which stops it."""
    seen: list[object] = []

    class Recorder(Progress):
        def event(self, event: object) -> None:
            seen.append(event)
            if isinstance(event, until):
                raise Stopped

    with pytest.raises(Stopped):
        close_loop(read_dataset(load_campaign(CAMPAIGN)), progress=Recorder())
    return seen


def test_a_loop_reports_its_events_and_can_be_stopped() -> None:
    events = events_until(ScoreTestResult)
    iterations = [e for e in events if isinstance(e, FitIteration)]
    before = next(e for e in events if isinstance(e, ModelValidated) and e.stage == "before")
    nominal = next(e for e in events if isinstance(e, ModelValidated) and e.stage == "declared")
    assert before.validation.nrmse < nominal.validation.nrmse
    assert iterations[-1].channels["e1"] < iterations[0].channels["e1"]
    # at the optimum the residual is orthogonal to the sensitivities
    assert max(abs(iterations[-1].rho[:5])) < 0.01 < 0.1 < max(abs(iterations[0].rho[:5]))
    done = [(e.done, e.total) for e in events if isinstance(e, ScoreTestProgress)]
    # preselection of all on short segments, then the best on long ones; each counts up to its total
    preselection, full = done[0][1], done[-1][1]
    assert full < preselection
    assert done == [*((i, preselection) for i in range(1, preselection + 1)), *((i, full) for i in range(1, full + 1))]
