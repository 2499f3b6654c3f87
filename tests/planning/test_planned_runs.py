"""Planned runs: their tracks, their refusals, and that they are what a simulation of the vehicle gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.planning.planned_runs import SAMPLING_RATE, planned_runs, simulate_runs
from railui.track.excitation import Excitation
from railui.vehicle.model import Model
from railui.vehicle.simulate import simulate_series
from tests.planning.files import plan_file

SPEC = "erri_b176_low seed=2"


def test_every_speed_is_run_on_every_track() -> None:
    runs = planned_runs([20.0, 30.0], [SPEC, "fra_4 seed=1"], 25.0)
    assert [run.speed for run in runs] == [20.0, 30.0, 20.0, 30.0]
    assert runs[0].source is runs[1].source
    assert runs[0].source.track.length >= 30.0 * 25.0


def test_runs_start_at_equally_spaced_places_along_a_track() -> None:
    runs = planned_runs([20.0, 30.0], [SPEC], 20.0, sections=3)
    length = runs[0].source.track.length
    assert length >= 3 * 30.0 * 20.0
    assert [run.start for run in runs[3:]] == pytest.approx([0.0, (length - 600.0) / 2, length - 600.0])
    assert runs[3].name == "30 m/s, 0 to 600 m"
    plan = plan_file({"ayf": "0.02 m/s^2"})
    model = Model(plan.campaign.design)
    first, second = simulate_runs(plan.campaign, model, runs[:2], plan.sensors).segments
    assert second.columns["s"][0] - first.columns["s"][0] == pytest.approx(runs[1].start)
    assert not np.allclose(first.columns["ayf"], second.columns["ayf"])


def test_a_recorded_track_that_is_too_short_is_refused_with_the_longest_duration(tmp_path: Path) -> None:
    file = tmp_path / "line.csv"
    s = np.arange(0.0, 500.0, 0.1)
    file.write_text("s [m],yw [m]\n" + "".join(f"{x:.1f},{1e-3 * np.sin(0.3 * x):.6f}\n" for x in s))
    with pytest.raises(ValueError, match=r"500 m long.* 30 s at 20 m/s are 600 m: plan at most 25 s"):
        planned_runs([20.0], [file], 30.0)


def test_a_line_with_curves_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "curve.csv"
    rows = "".join(f"{0.1 * i:.1f},0,0.001\n" for i in range(20_000))
    file.write_text("s [m],yw [m],curvature [1/m]\n" + rows)
    with pytest.raises(ValueError, match="has curves: plan runs on tangent track"):
        planned_runs([20.0], [file], 30.0)


def test_the_channels_are_those_of_a_simulation_on_the_track() -> None:
    plan = plan_file({"ayf": "0.02 m/s^2", "rf": "0.3 mrad/s"})
    model = Model(plan.campaign.design)
    runs = planned_runs([30.0], [SPEC], 20.0)
    (segment,) = simulate_runs(plan.campaign, model, runs, plan.sensors).segments
    assert segment.dt == 1.0 / SAMPLING_RATE
    excitation = Excitation(runs[0].source, 30.0)
    series, diverged = simulate_series(model, excitation, ["ayf", "rf"])
    assert diverged is None
    t = np.arange(series.shape[1]) * excitation.dt
    late = segment.columns["t"] > 5.0  # the start of the one at rest has decayed
    for name, simulated in zip(("ayf", "rf"), series, strict=True):
        expected = np.interp(segment.columns["t"][late], t, simulated)
        assert segment.columns[name][late] == pytest.approx(expected, abs=0.02 * np.std(expected))
