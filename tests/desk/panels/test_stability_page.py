"""Stability and Speed pages: named modes, critical speeds that stay, bands over seeds, nothing stale."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from textual.widgets import Static

from railui.desk.panels.design import DesignPanel
from railui.desk.panels.speed_page import SpeedPage
from railui.desk.panels.stability_page import StabilityPage
from railui.desk.presenters.speed_bands import BAND_SPEEDS, SEED_COUNT
from railui.desk.widgets.plot import Plot
from railui.ride_quality.evaluation import ride_many
from railui.running_stability.summary import stability
from tests.desk.conftest import Keyboard, OpenDesk

pytestmark = pytest.mark.asyncio
TRACK = "erri_b176_low length=400 seed=1"
STIFFNESS = "vehicle.primary.lateral_stiffness"


@pytest.fixture(autouse=True)
def short_track(tmp_path: Path) -> None:
    """Let the desk begin with a short track."""
    directory = tmp_path / "state/railui"
    directory.mkdir(parents=True)
    (directory / "desk.json").write_text(json.dumps({"track": TRACK}))


def limits(keys: Keyboard, plot: str) -> dict[str, float]:
    """Return the vertical limits of a plot by the first word of their labels."""
    data = keys.desk.query_one(f"#{plot}", Plot).data
    return {limit.label.split()[0]: limit.value for limit in data.limits if limit.is_vertical}


async def wait_for_critical_speeds(keys: Keyboard) -> None:
    """Wait until all critical speeds of the design are shown as lines."""
    await keys.wait_until(lambda: {"linear", "nonlinear", "ride"} <= set(limits(keys, "damping")))
    await keys.wait_until_idle()


async def check_modes(keys: Keyboard) -> None:
    """Check that the modes are named, and numbered as their lines."""
    plot = keys.desk.query_one("#damping", Plot)
    labels = [line.label for line in plot.data.lines]
    assert labels[0] == "1 hunting" and {"2 frame yaw", "3 frame lateral"} <= set(labels)
    text = str(keys.desk.query_one("#modes", Static).content)
    assert all(label in text for label in labels)
    roles = [line.role for line in plot.data.lines]
    marks = {mark.character: mark for mark in plot.data.marks}
    assert [marks[label[0]].role for label in labels] == roles
    assert len({(mark.x, mark.y) for mark in plot.data.marks}) == len(marks)
    hunting = plot.data.lines[0]
    crossing = hunting.x[int(np.argmax(hunting.y < 0))]
    assert crossing == pytest.approx(limits(keys, "damping")["linear"], abs=0.5)
    assert f"from {limits(keys, 'damping')['linear']:.1f} m/s" in text
    locus = keys.desk.query_one("#locus", Plot).data
    assert len(locus.lines) == len(labels) and locus.x.low is not None and locus.x.low < 0


async def check_other_design(keys: Keyboard) -> None:
    """Check that another design shows no critical speed of the one before."""
    first = limits(keys, "damping")
    panel = keys.desk.query_one(DesignPanel)
    page = keys.desk.query_one(StabilityPage)
    panel.set(STIFFNESS, "6 MN/m")
    await keys.wait_until(lambda: page.results is not None and page.results[0].design.value(STIFFNESS) == 6e6)
    assert not {"nonlinear", "ride"} & set(limits(keys, "damping"))
    await keys.wait_until(lambda: "linear" in limits(keys, "damping"))
    assert limits(keys, "damping")["linear"] != first["linear"]
    assert "base 66.3" in str(keys.desk.query_one("#critical", Static).content)
    await keys.press("ctrl+z")  # known already: at once
    assert limits(keys, "damping") == first


async def test_critical_speeds_are_those_of_the_command_and_stay(open_desk: OpenDesk, bogie: Path) -> None:
    expected = stability(bogie, fold=True, track=TRACK)
    async with open_desk(bogie, size=(160, 48)) as keys:
        await keys.press("l")
        await wait_for_critical_speeds(keys)
        found = limits(keys, "damping")
        assert found["linear"] == pytest.approx(expected["linear_critical_speed"])
        assert found["nonlinear"] == pytest.approx(expected["fold_speed"])
        assert found["ride"] == pytest.approx(expected["practical_critical_speed"])
        text = str(keys.desk.query_one("#critical", Static).content)
        assert f"{expected['fold_speed']:.1f} m/s" in text and "km/h" in text
        await keys.press("right_square_bracket", "f5", "f2", "l")
        assert limits(keys, "damping") == found  # the lines stay
        cycles = keys.desk.query_one("#cycles", Plot).data
        largest = max(line.y.max() for line in cycles.lines)
        assert largest == pytest.approx(1e3 * max(row["from_above"] or 0 for row in expected["fold"]["diagram"]))
        await check_modes(keys)
        await check_other_design(keys)


async def test_the_band_over_speed_spans_the_rides_of_every_seed(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie, size=(160, 48)) as keys:
        await keys.pilot.press("l", "right_square_bracket", "right_square_bracket")
        await keys.pilot.pause(1.0)
        await keys.wait_until_idle()
        stability_page, page = keys.desk.query_one(StabilityPage), keys.desk.query_one(SpeedPage)
        assert not stability_page.critical_job.is_active and not stability_page.known.results  # a hidden page
        assert not page.band_job.is_active
        await keys.press("left_square_bracket")
        await keys.wait_until(lambda: any(band.is_complete for band in page.bands.values()))
        data = keys.desk.query_one("#band-weighted_acceleration", Plot).data
        (band,) = data.bands
        assert band.label == f"{SEED_COUNT} seeds"
        speed = float(BAND_SPEEDS[4])
        values = [
            ride_many([bogie], TRACK.replace("seed=1", f"seed={1 + k}"), speed)[0]["weighted_acceleration"]
            for k in range(SEED_COUNT)
        ]
        assert band.low[4] == min(values) and band.high[4] == max(values)
        (mean,) = [line for line in data.lines if line.label == "current"]
        assert mean.y[4] == pytest.approx(np.mean(values))
        keys.desk.query_one(DesignPanel).set(STIFFNESS, "6 MN/m")
        await keys.wait_until(lambda: page.results is not None and page.results[0].design.value(STIFFNESS) == 6e6)
        data = keys.desk.query_one("#band-weighted_acceleration", Plot).data
        assert [line.label for line in data.lines] == ["base"]  # the curve before is that of the base now
        await keys.wait_until(lambda: all(band.is_complete for band in page.bands.values()))
        data = keys.desk.query_one("#band-weighted_acceleration", Plot).data
        assert [line.label for line in data.lines] == ["base", "current"] and len(data.bands) == 2


async def test_a_computation_that_fails_is_shown_as_failed(
    open_desk: OpenDesk, bogie: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ValueError("the fastest motion needs 9e9 steps")

    monkeypatch.setattr("railui.desk.services.stability_jobs._nonlinear", fail)
    async with open_desk(bogie, size=(160, 48)) as keys:
        await keys.press("l")
        await keys.wait_until(lambda: "ride" in limits(keys, "damping"))  # the next one is computed all the same
        text = str(keys.desk.query_one("#critical", Static).content)
        assert "failed" in text and "nonlinear: the fastest motion needs 9e9 steps" in text
