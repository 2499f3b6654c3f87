"""Sensor effects and the filter of simulated channels."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from scipy import signal

from railui.core import ZeroPhaseFilter
from tests.kernel.pairs import (
    CHANNELS,
    Floats,
    asymmetric_bogie,
    batch,
    interval,
    kernel,
    structure,
    table,
    tangent_run,
)
from tests.truth.effects import effect, parse
from tests.truth.march import simulate

VEHICLE, RUN = asymmetric_bogie(60), tangent_run(4.0)
DT = interval(RUN)


def band_pass(low: float, high: float, order: int = 4) -> Floats:
    return signal.butter(order, [low, high], "bandpass", fs=1.0 / DT, output="sos")


def through(filter: ZeroPhaseFilter, channels: tuple[str, ...] = CHANNELS, vehicles: int = 1) -> Floats:
    some = [asymmetric_bogie(60 + k) for k in range(vehicles)]
    return structure(VEHICLE).simulate(batch(some), table(RUN, VEHICLE.a, 1), DT, 1, channels, filter=filter)[0]


@pytest.mark.parametrize(
    ("low", "high", "order", "pad", "cut", "every"),
    [(0.4, 25.0, 4, 240, 80, 1), (0.7, 12.0, 2, 30, 0, 1), (2.0, 60.0, 3, 400, 133, 3)],
)
def test_a_filter_is_sosfiltfilt_and_a_cut_and_a_weight_per_channel(
    low: float, high: float, order: int, pad: int, cut: int, every: int
) -> None:
    sos = band_pass(low, high, order)
    weights = np.linspace(0.5, 2.0, len(CHANNELS))
    found = through(ZeroPhaseFilter(sos, signal.sosfilt_zi(sos), pad, cut, weights, every))[0]
    raw = np.array(list(kernel(VEHICLE, RUN).values()))
    whole = signal.sosfiltfilt(sos, raw, padtype="odd", padlen=pad)
    expected = weights[:, None] * whole[:, cut : raw.shape[1] - cut : every]
    assert found.shape == expected.shape
    assert np.abs(found - expected).max(axis=1) == pytest.approx(0.0, abs=1e-9 * np.abs(expected).max())


def test_a_filter_without_sections_takes_the_mean_off() -> None:
    none = ZeroPhaseFilter(np.zeros((0, 6)), np.zeros((0, 2)), 0, 50, np.ones(len(CHANNELS)))
    raw = np.array(list(kernel(VEHICLE, RUN).values()))
    expected = (raw - raw.mean(axis=1, keepdims=True))[:, 50:-50]
    assert np.allclose(through(none)[0], expected, rtol=0.0, atol=1e-12)


def test_every_lane_goes_through_the_filter_by_itself() -> None:
    sos = band_pass(0.4, 25.0)
    band = ZeroPhaseFilter(sos, signal.sosfilt_zi(sos), 100, 40, np.ones(2))
    found = structure(VEHICLE).simulate(
        batch([asymmetric_bogie(61), asymmetric_bogie(62)]), table(RUN, 1.28, 1), DT, 1, ("e1", "ayf"), filter=band
    )[0]
    single = structure(VEHICLE).simulate(
        batch([asymmetric_bogie(62)]), table(RUN, 1.28, 1), DT, 1, ("e1", "ayf"), filter=band
    )[0]
    assert np.array_equal(found[1], single[0])


def test_output_length_is_the_length_of_the_filtered_series() -> None:
    sos = band_pass(0.4, 25.0)
    for cut, every in ((0, 1), (10, 1), (10, 4), (133, 3)):
        band = ZeroPhaseFilter(sos, signal.sosfilt_zi(sos), 100, cut, np.ones(1), every)
        assert through(band, ("e1",)).shape[2] == band.output_length(len(RUN.t))


def test_a_segment_too_short_for_its_filter_is_an_error_with_the_numbers() -> None:
    sos = band_pass(0.4, 25.0)
    with pytest.raises(ValueError, match="800"):
        through(ZeroPhaseFilter(sos, signal.sosfilt_zi(sos), 900, 0, np.ones(len(CHANNELS))))


# ------------------------------------------------------------------------------------------------------- sensors


@pytest.mark.parametrize("delay", [0.02, 0.0137, 0.0012, -0.0137, 0.05])
@pytest.mark.parametrize("channel", ["e1", "ayf", "rf", "psi2"])
def test_a_delay_is_the_exact_shift_of_a_band_limited_signal(channel: str, delay: float) -> None:
    plain = kernel(VEHICLE, RUN)[channel]
    late = kernel(VEHICLE, RUN, [effect("sensor_delay", channel, delay=delay)])[channel]
    # what lies above a quarter of the sampling frequency is no signal; level ends, so that nothing wraps round
    ends = signal.windows.tukey(len(plain), 0.5)
    lines = np.fft.rfftfreq(len(plain), DT)
    smooth = np.fft.irfft(np.fft.rfft(ends * plain) * np.exp(-2j * np.pi * lines * delay), len(plain))
    inner = slice(len(plain) // 4 + 20, 3 * len(plain) // 4 - 20)
    assert np.abs(late - smooth)[inner].max() < 1e-4 * plain.std()


def test_a_delay_by_whole_samples_moves_the_samples() -> None:
    plain = kernel(VEHICLE, RUN)["d1"]
    late = kernel(VEHICLE, RUN, [effect("sensor_delay", "d1", delay=3 * DT)])["d1"]
    assert np.allclose(late[3:], plain[:-3], rtol=0.0, atol=1e-15)
    assert np.all(late[:3] == plain[0])


def test_gain_and_offset_are_those_of_the_formula_and_touch_their_channel_only() -> None:
    plain = kernel(VEHICLE, RUN)
    seen = kernel(VEHICLE, RUN, [effect("sensor_gain", "ay1", gain=-1.5), effect("sensor_offset", "ay1", offset=0.25)])
    assert np.allclose(seen["ay1"], -1.5 * plain["ay1"] + 0.25, rtol=0.0, atol=1e-14)
    for channel in set(CHANNELS) - {"ay1"}:
        assert np.array_equal(seen[channel], plain[channel])


SENSORS = [
    parse("sensor_delay at=ayf delay=0.0137"),
    parse("sensor_gain at=ayf gain=2"),
    parse("sensor_offset at=ayf offset=0.5"),
]


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_a_sensor_gives_gain_times_the_late_signal_plus_offset_however_it_is_listed(order: tuple[int, ...]) -> None:
    # x(t) -> gain x(t - delay) + offset
    faults = [SENSORS[i] for i in order]
    late = kernel(VEHICLE, RUN, SENSORS[:1])["ayf"]
    assert np.allclose(kernel(VEHICLE, RUN, faults)["ayf"], 2.0 * late + 0.5, rtol=0.0, atol=1e-12)


def test_sensor_effects_agree_with_those_of_the_generator() -> None:
    found, truth = kernel(VEHICLE, RUN, SENSORS)["ayf"], simulate(VEHICLE, RUN, SENSORS, 1)["ayf"]
    assert np.abs(found - truth)[10:].max() < 2e-3 * truth.std()  # eight points here, a cubic spline there


def test_half_a_sensor_law_is_half_its_parameter() -> None:
    plain = kernel(VEHICLE, RUN)["e2"]
    half = kernel(
        VEHICLE, RUN, [effect("sensor_gain", "e2", gain=3.0), effect("sensor_offset", "e2", offset=1.0)], amount=0.5
    )
    assert np.allclose(half["e2"], 2.0 * plain + 0.5, rtol=0.0, atol=1e-14)
