"""Saturation before the converter: a noisy plateau at an extreme, and motions that also dwell there."""

from __future__ import annotations

import numpy as np
import pytest

from railui.arrays import FloatArray
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.saturation import is_motion, saturated_samples
from railui.campaign.faults.waveform import waveform_faults
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from railui.runs.columns import Form

SETTINGS = FaultSettings()
N = 8000
DT = 2e-3
T = np.arange(N) * DT
NOISE = np.random.default_rng(4).standard_normal(N)
RANDOM = np.random.default_rng(5)
LINES = sum(
    a * np.sin(2.0 * np.pi * f * T + p)
    for f, a, p in zip(np.linspace(1.0, 9.0, 25), RANDOM.rayleigh(size=25), 6.3 * RANDOM.random(25), strict=True)
)
VIBRATION = LINES / np.abs(LINES).max()


def clipping_of(kind: Form, **columns: FloatArray) -> list[Fault]:
    segment = Segment("a", "adjust", 0, {"t": T, **columns}, DT, kind)
    return [f for f in waveform_faults([segment], SETTINGS, None) if f.kind == "clipping"]


@pytest.mark.parametrize("limit", [0.5, 0.7])
@pytest.mark.parametrize("sd", [1e-5, 1e-4, 5e-4])
@pytest.mark.parametrize("bits", [None, 10])
def test_a_noisy_plateau_is_saturation(limit: float, sd: float, bits: int | None) -> None:
    step = 2.0**-9
    x = VIBRATION if bits is None else step * np.round(VIBRATION / step)
    limit = step * np.round(limit / step)
    expected = int(np.sum(np.abs(x) >= limit))
    found = saturated_samples(np.clip(x, -limit, limit) + sd * NOISE, SETTINGS)
    assert expected > 100 and 0.4 * expected < len(found) < 1.1 * expected


def test_few_samples_in_a_period_suffice() -> None:
    coarse = VIBRATION[::13]  # 6 at the highest frequency
    found = saturated_samples(np.clip(coarse, -0.4, 0.4) + 1e-4 * NOISE[::13], SETTINGS)
    assert len(found) > 0.3 * np.sum(np.abs(coarse) > 0.4) > 10


def test_one_side_may_be_cut_off() -> None:
    found = saturated_samples(np.minimum(VIBRATION, 0.4) + 1e-4 * NOISE, SETTINGS)
    assert np.all(VIBRATION[found] > 0.37) and len(found) > 0.5 * np.sum(VIBRATION > 0.4)


@pytest.mark.parametrize("sd", [0.0, 1e-5, 1e-3])
@pytest.mark.parametrize("step", [0.0, 2.0**-11, 2.0**-4])
@pytest.mark.parametrize("x", [VIBRATION, np.sin(11.0 * T), np.sin(11.0 * T) * np.exp(-0.3 * T)])
def test_turning_points_and_few_bits_are_not(x: FloatArray, step: float, sd: float) -> None:
    noisy = x + sd * NOISE
    assert len(saturated_samples(noisy if step == 0.0 else step * np.round(noisy / step), SETTINGS)) == 0


def sticking(dwell: float, rate: float) -> FloatArray:
    """Sine that rests at each turning point for a share of a half period, as a mass that sticks by friction does."""
    phase = rate * T
    moving = np.minimum((phase % 1.0) / (1.0 - dwell), 1.0)
    return np.asarray(np.cos(np.pi * (moving + np.floor(phase))))


@pytest.mark.parametrize("rate", [4.9, 24.1, 51.3])
@pytest.mark.parametrize("dwell", [0.2, 0.5, 0.8])
def test_a_mass_that_comes_to_rest_at_its_turning_points_is_not(dwell: float, rate: float) -> None:
    x = sticking(dwell, rate)
    assert np.sum(x > 1.0 - 1e-6) > 0.4 * dwell * N
    assert len(saturated_samples(x + 1e-4 * NOISE, SETTINGS)) == 0


def test_rest_between_pulses_is_not() -> None:
    pulses = np.maximum(np.sin(9.0 * T), 0.0) * (np.sin(1.8 * T) > 0.3)
    assert len(saturated_samples(pulses + 1e-4 * NOISE, SETTINGS)) == 0


def test_a_mass_that_rests_on_a_stop_is_motion_by_its_acceleration() -> None:
    z = np.minimum(VIBRATION, 0.4)
    found = saturated_samples(z + 1e-4 * NOISE, SETTINGS)
    acceleration = np.gradient(np.gradient(VIBRATION, T), T)
    assert len(found) and is_motion({"az": np.where(z < 0.4, acceleration, 0.0)}, found, SETTINGS)
    assert not is_motion({"az": acceleration}, found, SETTINGS)
    assert not is_motion({"u": VIBRATION}, found, SETTINGS)


def test_a_plateau_of_the_input_passes_to_the_displacement() -> None:
    u = np.clip(1.5 * np.sin(5.0 * T), -1.0, 1.0)
    found = saturated_samples(u + 1e-4 * NOISE, SETTINGS)
    assert len(found) and is_motion({"u": u}, found, SETTINGS)


def test_a_saturated_channel_is_a_serious_fault_and_the_force_of_a_damper_is_not() -> None:
    cut = np.clip(VIBRATION, -0.5, 0.5) + 1e-4 * NOISE
    (fault,) = clipping_of("rig", u=VIBRATION[::-1], z=cut)
    assert fault.serious and fault.channels == ("z",) and "before the converter" in fault.text
    assert clipping_of("rig", u=VIBRATION[::-1], z=VIBRATION + 1e-4 * NOISE) == []
    assert clipping_of("bench", z=VIBRATION, F=cut) == []
