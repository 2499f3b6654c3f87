"""Notes on rigs: an input recorded late, an input without stated noise, and motions that no estimation run reaches."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from railui.identification.result import LoopResult
from railui.report.loop.motion_notes import unreached_motion_notes
from railui.report.loop.rig_notes import late_input_notes, unstated_input_noise_notes
from railui.vehicle.effects import PlacedEffect


def segment(**columns: float) -> SimpleNamespace:
    """Segment of a rig whose columns are sines of these amplitudes."""
    wave = np.sin(np.linspace(0.0, 20.0, 400))
    channels = [c for c in columns if c != "u"]
    return SimpleNamespace(kind="rig", channels=channels, columns={c: a * wave for c, a in columns.items()})


def result(*segments: SimpleNamespace, verdict: str = "outside", noise: Any = None, **delays: float) -> LoopResult:
    effects = tuple(PlacedEffect("sensor_delay", at, None, {"delay": x}) for at, x in delays.items())
    dataset = SimpleNamespace(
        segments=segments,
        estimation=segments[:1],
        selection=segments[1:],
        campaign=SimpleNamespace(noise={}),
    )
    context = SimpleNamespace(noise=noise or {})
    after = SimpleNamespace(model=SimpleNamespace(effects=effects))
    return cast(LoopResult, SimpleNamespace(dataset=dataset, context=context, verdict=verdict, after=after))


def test_equal_delays_of_all_channels_are_one_of_the_input() -> None:
    driven = segment(u=1.0, z=1.0, az=1.0)
    (note,) = late_input_notes(result(driven, driven, z=-6.01e-3, az=-6.0e-3))
    assert "u is recorded 6 ms late" in note and "`sensors: {u: {delay: 6 ms}}`" in note
    (note,) = late_input_notes(result(driven, driven, z=2e-3, az=2e-3))
    assert "2 ms early" in note and "delay: -2 ms" in note


@pytest.mark.parametrize("delays", [{"z": -6e-3}, {"z": -6e-3, "az": -5e-3}, {"z": -6e-3, "az": 6e-3}, {}])
def test_other_delays_are_those_of_sensors(delays: dict[str, float]) -> None:
    driven = segment(u=1.0, z=1.0, az=1.0)
    assert late_input_notes(result(driven, driven, **delays)) == []


def test_a_residual_of_a_rig_is_no_force_before_the_noise_of_its_input_is_stated() -> None:
    driven, free = segment(u=1.0, z=1.0), segment(u=0.0, z=1.0)
    assert "no noise is stated for the input u" in unstated_input_noise_notes(result(driven, driven))[0]
    assert unstated_input_noise_notes(result(driven, driven, noise={"u": 0.1})) == []
    assert unstated_input_noise_notes(result(driven, driven, verdict="none")) == []
    assert unstated_input_noise_notes(result(free, free)) == []


def test_a_motion_beyond_that_of_the_estimation_runs_is_noted() -> None:
    near, far = segment(u=1.0, z=5e-3), segment(u=1.0, z=12e-3)
    (note,) = unreached_motion_notes(result(near, far))
    assert "z moves by 12 mm on the validation runs, by 5 mm at most on the estimation runs" in note
    assert unreached_motion_notes(result(far, near)) == []
    assert unreached_motion_notes(result(near, segment(u=1.0, z=6e-3))) == []
    assert unreached_motion_notes(result(near, far, verdict="effect")) == []
