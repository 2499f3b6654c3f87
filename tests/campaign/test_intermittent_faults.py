"""Faults of a channel during a part of a run: named with the run and the interval, and not where all disagree alike."""

from __future__ import annotations

import numpy as np
import pytest

from railui.campaign.faults.diagnose import diagnose
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.intermittent import find_intermittent_fault
from railui.campaign.faults.spectra import RunSpectra
from railui.campaign.settings.faults import FaultSettings
from tests.blind.faults import PlantedFault, noisy, partly, retimed, scaled, with_faults
from tests.blind.simulated import simulated_campaign

RUN = "run_a.csv.gz"


def faults_of(*plants: PlantedFault) -> tuple[Fault, ...]:
    """Diagnose a simulated campaign with faults planted into its first run."""
    dataset = simulated_campaign().dataset
    return diagnose(with_faults(dataset, plants, runs=(RUN,))).faults


def during(plant, first: float = 0.3, last: float = 0.7) -> PlantedFault:
    return PlantedFault("", (), "", partly(plant, first, last))


@pytest.mark.parametrize("channel", ["e1", "ay1", "ayf", "rf", "d2"])
def test_a_channel_with_half_its_gain_in_the_middle_of_a_run_is_named_with_run_and_time(channel: str) -> None:
    (fault,) = faults_of(during(scaled(channel, gain=0.5)))
    assert (fault.kind, fault.channels, fault.files, fault.serious) == ("intermittent", (channel,), (RUN,), True)
    assert fault.yaml == f"sensors: {{{channel}: {{leave_out: true, runs: [{RUN}]}}}}" and not fault.alternatives
    assert fault.value == pytest.approx(0.5, abs=0.03)
    t = simulated_campaign().dataset.segments[0].columns["t"]
    middle = (t[0] + 0.3 * np.ptp(t), t[0] + 0.7 * np.ptp(t))
    assert fault.interval == pytest.approx(middle, abs=2.0)
    finding = fault.finding()
    assert (finding.start, finding.end) == fault.interval and "0.5 times too large" in finding.text


def test_a_noisy_end_of_a_run_is_named() -> None:
    (fault,) = faults_of(during(noisy("ay2", 0.3), 0.6, 1.0))
    assert (fault.kind, fault.channels, fault.serious) == ("intermittent", ("ay2",), True)
    assert "times as far" in fault.text and fault.value is not None
    assert 10.0 < fault.value < 37.0  # as a power, of which the noise of the other channels is a part


def test_two_channels_that_fail_together_are_both_named() -> None:
    found = faults_of(during(noisy("ay1", 0.4), 0.5, 1.0), during(noisy("d2", 3e-4), 0.5, 1.0))
    assert {(f.kind, f.channels) for f in found} == {("intermittent", ("ay1",)), ("intermittent", ("d2",))}


def test_a_track_column_cannot_be_left_out() -> None:
    (fault,) = faults_of(during(scaled("yw", gain=0.5)))
    assert (fault.kind, fault.channels, fault.yaml, fault.is_correctable) == ("intermittent", ("yw",), None, False)
    assert "empty the cells of yw" in fault.remedy


def test_a_clock_that_drifts_is_no_intermittent_fault() -> None:
    found = faults_of(PlantedFault("", (), "", retimed("e1", "e2", rate=1.002)))
    assert [f.kind for f in found] == ["clock"]


def run_of_three_relations(seed: int, strength: np.ndarray, gain: float = 1.0) -> RunSpectra:
    """Four channels that measure one motion of a strength in each window, with noise; the first has a gain."""
    rng = np.random.default_rng(seed)

    def draw(*shape: int) -> np.ndarray:
        return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)

    windows, lines = len(strength), 40
    z = 10.0 * strength[:, None, None] * draw(windows, lines, 1) + draw(windows, lines, 4)
    z[..., 0] *= gain
    relations = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 1.0, -1.0, 0.0], [0.0, 0.0, 1.0, -1.0]])
    time = 1.28 * np.arange(windows)
    names = ("ay1", "ay2", "ayf", "rf")
    return RunSpectra(names, np.linspace(0.6, 20.0, lines), z, time, np.full(windows, 40.0), relations)


def test_a_constant_error_of_a_gain_is_none_where_the_motion_is_stronger_for_a_time() -> None:
    """The disagreement is eleven times as large there, as a power, as the motion is."""
    strength = 1.0 + 0.4 * np.random.default_rng(5).random(40)
    strength[12:28] *= 4.0
    assert find_intermittent_fault(run_of_three_relations(1, strength, gain=1.15), FaultSettings()) is None


def test_sound_windows_give_no_alarm_and_one_of_three_times_the_noise_does() -> None:
    """None of 200 runs of 40 windows, far more than the family-wise level admits if it were not met."""
    settings, level = FaultSettings(), np.ones(40)
    assert not any(find_intermittent_fault(run_of_three_relations(s, level), settings) for s in range(200))
    spectra = run_of_three_relations(1, level)
    rng = np.random.default_rng(2)
    spectra.z[12:28, :, 2] += np.sqrt(8.0) * (rng.standard_normal((16, 40)) + 1j * rng.standard_normal((16, 40)))
    fault = find_intermittent_fault(spectra, settings)
    assert fault is not None and (fault.channel, fault.others, fault.gain) == ("ayf", (), None)
    assert (fault.start, fault.end) == pytest.approx((11.5 * 1.28, 27.5 * 1.28), abs=1.3)
