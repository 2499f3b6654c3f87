"""Few measured responses, down to one: the loop ends and names no location that they cannot distinguish."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from railui import core
from railui.campaign.dataset import Dataset
from railui.campaign.noise.model import NoiseModel
from railui.campaign.segment import Segment
from railui.identification.context import create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.problem import prepare_segments
from railui.identification.loop import close_loop
from railui.identification.structure.equivalent_inputs import (
    ForceLocation,
    WindowedShare,
    _exceeds_noise,
    _noise,
    _share,
    _standard_error,
    locate_forces,
)
from railui.progress import Progress
from railui.report.loop.data import loop_report
from tests.blind.simulated import SimulatedCampaign, calibrated, simulated_campaign

PLAY = "free_play at=primary_lateral half_width=4e-4"
CLOCK = ("t", "s", "v", "yw")


class Lines(Progress):
    """Messages of a loop."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def message(self, text: str) -> None:
        """Collect a message."""
        self.texts.append(text)


def reduced(case: SimulatedCampaign, responses: tuple[str, ...]) -> Dataset:
    """Keep only the track and some responses of a campaign."""

    def reduce(segment: Segment) -> Segment:
        columns = {name: x for name, x in segment.columns.items() if name in (*CLOCK, *responses)}
        return replace(segment, columns=columns, tables={})

    return replace(case.dataset, segments=tuple(reduce(s) for s in case.dataset.segments))


@pytest.mark.parametrize(
    ("responses", "max_forces"),
    [(("ayf", "rf"), 1), (("ay1", "ayf", "rf"), 1), (("ay1", "ay2", "ayf", "rf"), 2)],
)
def test_the_first_locations_have_at_most_half_as_many_forces_as_there_are_channels(
    responses: tuple[str, ...], max_forces: int
):
    case = simulated_campaign(PLAY)
    context = create_context(reduced(case, responses), jobs=2)
    locations = locate_forces(context, calibrate(context))
    assert max(o.forces for o in locations if o.chance <= 0.5) == max_forces
    assert [o.chance > 0.5 for o in locations] == sorted(o.chance > 0.5 for o in locations)
    assert max(o.forces for o in locations) < len(responses)
    assert all(math.isfinite(o.share) and o.share < 1.0 for o in locations)


@pytest.mark.parametrize(("excess", "exceeds"), [(0.0, False), (0.3, True)])
def test_a_residual_of_noise_locates_no_force(excess: float, exceeds: bool) -> None:
    """Its squares less the noise are near zero, of which forces explain any share."""
    totals = np.random.default_rng(4).normal(excess, 0.3, 60)
    shares = [WindowedShare(part, part / 2, 0.25) for part in np.split(totals, 3)]
    assert _exceeds_noise(shares, 2.0) is exceeds


def test_the_sensors_of_every_window_have_their_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """The track and its noise are those of the run; a sensor has no noise twice."""
    case, fit = simulated_campaign(), calibrated()
    sensors, tables = [], []
    draw, noisy_table = NoiseModel.draw, Segment.noisy_table

    def drawn(self, *given):
        sensors.append(draw(self, *given))
        return sensors[-1]

    def table(self, noise, band, rng, *given):
        tables.append(rng.bit_generator.state["state"]["state"])
        return noisy_table(self, noise, band, rng, *given)

    monkeypatch.setattr(NoiseModel, "draw", drawn)
    monkeypatch.setattr(Segment, "noisy_table", table)
    prepared = prepare_segments(case.context, fit.model, case.dataset.estimation[0].windows(8.0)[:2])
    for records in (sensors, tables):  # those of the weights
        records.clear()
    for target in prepared:
        _noise(case.context, fit, target)
    half = len(sensors) // 2
    assert len(tables) % 2 == 0 and tables[: len(tables) // 2] == tables[len(tables) // 2 :]
    assert abs(np.corrcoef(sensors[0][0, :1000], sensors[half][0, :1000])[0, 1]) < 0.2


@pytest.mark.slow
def test_a_loop_on_one_response_reaches_a_verdict():
    excluded = [r["kind"] for r in core.effect_catalogue() if r["kind"] not in ("quadratic_damper", "sensor_gain")]
    dataset = reduced(simulated_campaign(PLAY), ("ayf",))
    lines = Lines()
    report = loop_report(close_loop(dataset, without=excluded, jobs=2, progress=lines))
    assert any("single channel" in line for line in lines.texts)
    assert report["verdict"] == "outside" and report["unexplained"] > 1.3
    assert report["outside"]["at"] is None and "not located" in report["sentence"]


def test_the_share_of_forces_is_one_ratio_over_all_segments():
    def segment(total: float, explained: float) -> WindowedShare:
        return WindowedShare(np.array([total]), np.array([explained]), 0.5)

    # (60 - 50) / 50; a segment at its noise floor, whose own ratio would be 3, changes little
    assert _share([segment(100.0, 60.0)]) == pytest.approx(0.2)
    assert _share([segment(100.0, 60.0), segment(-0.5, -1.0)]) == pytest.approx(9.25 / 49.75)
    assert _share([segment(-0.5, -1.0)]) == 0.0


def test_locations_are_compared_on_the_segments_that_both_have():
    """One segment has seven channels, the other three, too few for a location of three forces."""
    many, few = np.full(4, 10.0), np.full(4, 2.0)
    whole = WindowedShare(many, 0.9 * many, 1 / 7, 0), WindowedShare(few, 0.4 * few, 1 / 3, 1)
    part = (WindowedShare(many, 0.8 * many, 3 / 7, 0),)
    first = ForceLocation("primary_lateral", 1, _share(whole), 1, 0.0, whole)
    other = ForceLocation("contact", None, _share(part), 3, 0.0, part)
    lead, standard_error = first.lead(other)
    assert lead == pytest.approx((0.9 - 1 / 7) / (6 / 7) - (0.8 - 3 / 7) / (4 / 7))
    assert standard_error == pytest.approx(0.0, abs=1e-12)
    assert first.chance == pytest.approx((1 / 7 + 1 / 3) / 2)
    swapped = ForceLocation("primary_lateral", 1, _share(whole), 1, 0.0, whole[::-1])
    assert swapped.lead(other) == pytest.approx(first.lead(other)) and swapped.chance == pytest.approx(first.chance)
    assert _standard_error(whole) == pytest.approx(_standard_error(whole[::-1]))
    assert first.lead(ForceLocation("frame", None, 0.2, 2))[1] == np.inf
