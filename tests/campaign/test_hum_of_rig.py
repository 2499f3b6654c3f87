"""Mains hum in the channels of a rig or a component, and harmonics of its drive."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from railui.campaign.faults.fault import Fault
from railui.campaign.faults.waveform import waveform_faults
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from tests.truth.laws import Array

RATE, SAMPLES = 500.0, 10000
T = np.arange(SAMPLES) / RATE
HUM = 20.0 * np.sin(2.0 * np.pi * 50.0 * T + 0.3)


def spring(z: Array, v: Array) -> Array:
    return 1.2e5 * z + 2.5e3 * v


def friction(z: Array, v: Array) -> Array:
    return spring(z, v) + 1500.0 * np.tanh(v / 2e-3)


def knee(z: Array, v: Array) -> Array:
    """A damper that opens at 0.1 m/s."""
    return np.where(np.abs(v) < 0.1, 2e4 * v, np.sign(v) * (2000.0 + 3000.0 * (np.abs(v) - 0.1)))


def bench(
    index: int, frequency: float, amplitude: float, law: Callable[[Array, Array], Array], extra: Array
) -> Segment:
    w = 2.0 * np.pi * frequency
    z, v = amplitude * np.sin(w * T), amplitude * w * np.cos(w * T)
    force = law(z, v) + extra
    force = force + 0.002 * force.std() * np.random.default_rng(index).standard_normal(SAMPLES)
    return Segment(f"{index}.csv", "adjust", 0, {"t": T, "z": z, "F": force}, 1.0 / RATE, "bench", run_index=index)


def hum(*segments: Segment) -> list[Fault]:
    return [f for f in waveform_faults(segments, FaultSettings(), None) if f.kind == "hum"]


@pytest.mark.parametrize("law", [friction, knee])
def test_harmonics_of_a_sine_are_no_hum(law: Callable[[Array, Array], Array]) -> None:
    drives = ((0.5, 0.01), (2.0, 0.02), (4.0, 0.006), (3.0, 0.01), (1.0, 0.02))
    assert hum(*(bench(i, f, a, law, np.zeros(SAMPLES)) for i, (f, a) in enumerate(drives))) == []


def test_hum_at_a_multiple_of_the_drive_is_found() -> None:
    [fault] = hum(*(bench(i, f, 0.005, spring, HUM) for i, f in enumerate((0.5, 1.0, 2.0, 3.0))))
    assert fault.value == pytest.approx(50.0) and len(fault.files) == 4 and not fault.serious
    assert fault.yaml == "sensors: {F: {hum: 50 Hz}}"


def test_hum_of_two_mains_is_not_averaged() -> None:
    other = 20.0 * np.sin(2.0 * np.pi * 60.0 * T)
    found = hum(bench(0, 0.7, 0.005, spring, HUM), bench(1, 0.7, 0.005, spring, other))
    assert [(round(f.value or 0.0, 2), f.files) for f in found] == [(50.0, ("0.csv",)), (60.0, ("1.csv",))]


def test_a_line_of_the_prescribed_motion_is_no_hum() -> None:
    part = bench(0, 0.7, 0.005, spring, np.zeros(SAMPLES))
    z = part.columns["z"] + 1e-4 * np.sin(2.0 * np.pi * 50.0 * T)
    force = part.columns["F"] + 12.0 * np.sin(2.0 * np.pi * 50.0 * T)
    assert hum(Segment("a", "adjust", 0, {"t": T, "z": z, "F": force}, 1.0 / RATE, "bench")) == []


def test_a_free_motion_at_a_mains_frequency_is_no_hum() -> None:
    t = np.arange(4000) / 400.0
    z = np.exp(-0.5 * t) * np.sin(2.0 * np.pi * 60.0 * t) + 0.003 * np.random.default_rng(0).standard_normal(4000)
    assert hum(Segment("a", "adjust", 0, {"t": t, "z": z}, 1.0 / 400.0, "rig")) == []
