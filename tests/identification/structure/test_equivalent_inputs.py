"""The loop where few responses were measured, down to one: it ends, and names no place that they cannot tell apart."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from railui import core
from railui.campaign.dataset import Dataset, Segment
from railui.identification.loop import calibrate, close_loop
from railui.identification.structure.equivalent_inputs import locate_forces
from railui.report.loop.data import loop_report
from tests.blind.made import SimulatedCampaign, simulated_campaign

PLAY = "free_play at=primary_lateral half_width=4e-4"
CLOCK = ("t", "s", "v", "yw")


def few(one: SimulatedCampaign, responses: tuple[str, ...]) -> Dataset:
    """The campaign as if nothing had been measured but the track and some responses."""

    def less(stretch: Segment) -> Segment:
        columns = {name: x for name, x in stretch.columns.items() if name in (*CLOCK, *responses)}
        return replace(stretch, columns=columns, tables={})

    return replace(one.dataset, segments=tuple(less(s) for s in one.dataset.segments))


@pytest.mark.parametrize(("responses", "most"), [(("ayf", "rf"), 1), (("ay1", "ayf", "rf"), 2)])
def test_a_place_has_fewer_forces_than_there_are_channels(responses: tuple[str, ...], most: int):
    one = simulated_campaign(PLAY)
    measurement = few(one, responses)
    found = locate_forces(calibrate(measurement, one.nominal, jobs=2), measurement)
    assert max(o.forces for o in found) == most
    assert all(math.isfinite(o.share) and o.share < 1.0 for o in found)


def test_a_loop_on_one_response_comes_to_a_verdict():
    barred = [r["kind"] for r in core.catalogue() if r["kind"] not in ("quadratic_damper", "sensor_gain")]
    measurement = few(simulated_campaign(PLAY), ("ayf",))
    lines: list[str] = []
    report = loop_report(close_loop(measurement, without=barred, jobs=2, report=lines.append))
    assert any("single channel" in line for line in lines)
    assert report["verdict"] in ("none", "effect", "outside") and report["unexplained"] > 1.3
    assert "Something is still missing" in report["sentence"]
