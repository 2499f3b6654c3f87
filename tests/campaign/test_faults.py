"""Diagnosis of data faults: the smallest set of faulty channels, with the correction of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railui.campaign.corrections.correction import Correction, Corrections, yaml_line
from railui.campaign.dataset import Dataset
from railui.campaign.faults.diagnose import corrected_segment, diagnose
from railui.campaign.faults.families import discrete_hypotheses
from railui.campaign.faults.fault import Diagnosis, Fault
from tests.blind.faults import (
    INERTIAL,
    PlantedFault,
    clipped,
    exchanged,
    moved_track,
    retimed,
    scaled,
    with_faults,
    with_gravity,
    with_hum,
    with_spikes,
)
from tests.blind.simulated import simulated_campaign


def diagnosis_of(*plants: Any, missing: Sequence[str] = ()) -> Diagnosis:
    """Diagnose a campaign into which faults were planted."""
    return diagnose(faulty(*plants, missing=missing))


def faulty(*plants: Any, missing: Sequence[str] = ()) -> Dataset:
    """Return the dataset of a simulated campaign with planted faults."""
    return with_faults(simulated_campaign().dataset, [PlantedFault("", (), "", p) for p in plants], missing)


def only(diagnosis: Diagnosis) -> Fault:
    """Return the only fault of a diagnosis."""
    (fault,) = diagnosis.faults
    return fault


def test_sound_data_have_no_fault() -> None:
    assert diagnose(simulated_campaign().dataset).faults == ()


@pytest.mark.parametrize("channel", ["e2", "ay1", "rf", "d1", "yw", "phiw"])
def test_a_wrong_sign_blames_the_channel_and_not_its_neighbours(channel: str) -> None:
    fault = only(diagnosis_of(scaled(channel, gain=-1.0)))
    assert (fault.kind, fault.channels, fault.serious, fault.alternatives) == ("sign", (channel,), True, ())
    assert fault.yaml == f"sensors: {{{channel}: {{gain: -1}}}}"


@pytest.mark.parametrize(
    "missing", [("e1", "e2", "d1", "d2"), ("ay1", "ay2", "ayf"), ("e1", "e2", "ay1", "ay2", "d1", "d2", "rf")]
)
def test_a_reversed_cross_level_is_found_by_the_motion_that_it_causes(missing: Sequence[str]) -> None:
    """No relation between these channels shows it. All else reversed, by a wrong convention, leaves the same data."""
    fault = only(diagnosis_of(scaled("phiw", gain=-1.0), missing=missing))
    assert (fault.kind, fault.channels, fault.serious) == ("sign", ("phiw",), True)
    assert fault.yaml == "sensors: {phiw: {gain: -1}}" and "`convention`" in fault.text
    others = [c for c in ("yw", "e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2") if c not in missing]
    assert only(diagnosis_of(scaled(*others, gain=-1.0), missing=missing)).yaml == fault.yaml
    assert diagnosis_of(missing=missing).faults == ()


def test_a_wrong_unit_is_named() -> None:
    assert only(diagnosis_of(scaled("ay2", gain=1 / 9.80665))).yaml == "sensors: {ay2: {unit: g}}"
    assert only(diagnosis_of(scaled("d2", gain=10.0))).yaml == "sensors: {d2: {gain: 10}}"


def test_a_wrong_unit_is_found_once_by_relations_and_by_the_response() -> None:
    fault = only(diagnosis_of(scaled("ay1", gain=1 / 9.80665), missing=("e1", "e2")))
    assert fault.yaml == "sensors: {ay1: {unit: g}}"


def test_exchanged_channels_are_named_together() -> None:
    fault = only(diagnosis_of(exchanged("e1", "e2")))
    assert (fault.kind, set(fault.channels)) == ("exchanged", {"e1", "e2"})


@pytest.mark.parametrize("missing", [(), ("ay1", "ay2")])
def test_all_sensors_of_the_ends_may_be_exchanged(missing: Sequence[str]) -> None:
    pairs = [pair for pair in (("e1", "e2"), ("ay1", "ay2"), ("d1", "d2")) if not set(pair) & set(missing)]
    fault = only(diagnosis_of(*(exchanged(*pair) for pair in pairs), missing=missing))
    assert (fault.kind, fault.serious, fault.alternatives) == ("exchanged", True, ())
    assert {(c.channel, c.swap_with) for c in fault.corrections.channels} == set(pairs)


@pytest.mark.parametrize("missing", [(), ("e1", "e2"), ("ay1", "ay2")])
def test_deflections_that_both_have_the_wrong_sign_are_not_exchanged(missing: Sequence[str]) -> None:
    """The frame follows slow motions of the wheelsets, so that d1 is nearly -d2 there."""
    fault = only(diagnosis_of(scaled("d1", "d2", gain=-1.0), missing=missing))
    assert (fault.kind, fault.channels, fault.is_correctable) == ("sign", ("d1", "d2"), True)
    assert only(diagnosis_of(exchanged("d1", "d2"), missing=missing)).kind == "exchanged"


def test_deflections_of_which_only_the_difference_is_known_may_be_either() -> None:
    for plant in (scaled("d1", "d2", gain=-1.0), exchanged("d1", "d2")):
        fault = only(diagnosis_of(plant, missing=("ay1", "ay2", "ayf")))
        assert fault.serious and not fault.is_correctable
        assert fault.yaml == "sensors: {d1: {gain: -1}, d2: {gain: -1}}"
        assert fault.alternatives == ("sensors: {d1: {swap_with: d2}}",)


def test_a_track_that_is_recorded_elsewhere_is_measured_in_metres() -> None:
    fault = only(diagnosis_of(moved_track(0.4)))
    assert (fault.kind, fault.serious) == ("track_offset", True)
    assert fault.value == pytest.approx(0.4, abs=0.03)
    far = only(diagnosis_of(moved_track(2.0)))  # most of the way from one wheelset to the next
    assert (far.kind, far.value) == ("track_offset", pytest.approx(2.0, abs=0.1))


def test_a_drifting_clock_is_measured_by_its_rate() -> None:
    fault = only(diagnosis_of(retimed(*INERTIAL, rate=1.0008)))
    assert (fault.kind, set(fault.channels)) == ("clock", set(INERTIAL))
    assert fault.value == pytest.approx(1.0008, abs=5e-5)


def test_gravity_through_roll_is_measured() -> None:
    fault = only(diagnosis_of(with_gravity("ayf", 9.81)))
    assert (fault.kind, fault.channels) == ("gravity", ("ayf",))
    assert fault.value == pytest.approx(9.81, rel=0.15)


def test_hum_is_found_and_wheel_turns_are_not_hum() -> None:
    fault = only(diagnosis_of(with_hum("d1", 50.05, 0.5)))
    assert (fault.kind, fault.channels) == ("hum", ("d1",))
    assert fault.value == pytest.approx(50.05, abs=0.05)
    speed = simulated_campaign().dataset.segments[0].mean_speed
    assert abs(speed / (2 * np.pi * 0.46) - 50.0 / 3.0) > 0.7  # a wheel at this speed would be excused


def test_two_faults_are_both_named() -> None:
    diagnosis = diagnosis_of(scaled("e1", gain=-1.0), scaled("e2", gain=-1.0))
    assert {(f.kind, f.channels) for f in diagnosis.serious} == {("sign", ("e1",)), ("sign", ("e2",))}


def test_a_clipped_channel_can_only_be_left_out() -> None:
    fault = diagnosis_of(clipped("d2", 1.5)).serious[0]
    assert (fault.kind, fault.yaml) == ("clipping", "sensors: {d2: {leave_out: true}}")


def test_a_fault_of_one_run_names_the_run() -> None:
    dataset = simulated_campaign().dataset
    first, *others = dataset.segments
    flipped = replace(first, columns={**first.columns, "rf": -first.columns["rf"]}, tables={})
    fault = only(diagnose(replace(dataset, segments=(flipped, *others))))
    assert (fault.kind, fault.files) == ("sign", (first.file,))
    assert fault.yaml == f"sensors: {{rf: {{gain: -1, runs: [{first.file}]}}}}"


def test_a_speed_in_another_unit_is_the_only_fault_named() -> None:
    """The response to the track at 3.6 times the speed contradicts every sensor."""
    sound = simulated_campaign().dataset
    for missing in ((), ("e1", "e2", "d1", "d2")):
        fault = only(diagnose(with_faults(sound, [PlantedFault("", (), "", scaled("v", gain=3.6))], missing)))
        assert (fault.channels, fault.serious, fault.is_correctable) == (("v",), True, False)
        assert "v [km/h]" in fault.remedy and fault.files == ("run_a.csv.gz",)


@pytest.mark.parametrize(("column", "factor"), [("t", 10.0), ("s", 1.5), ("v", 0.5)])
def test_a_distance_that_contradicts_speed_and_time_is_the_only_fault_named(column: str, factor: float) -> None:
    """The track under the trailing wheelset is taken from a wrong place, which contradicts its sensors."""
    fault = only(diagnosis_of(scaled(column, gain=factor)))
    assert (fault.channels, fault.serious, fault.is_correctable) == (("s",), True, False)
    assert fault.files == ("run_a.csv.gz", "run_b.csv.gz") and "unit of t, v or s" in fault.remedy
    assert only(diagnosis_of(scaled(column, gain=factor), missing=("e1", "e2", "d1", "d2"))) == fault


def test_a_speed_in_another_unit_is_known_by_the_time_between_the_wheelsets() -> None:
    """Speed and distance agree, so that only the track under the trailing wheelset contradicts its sensors."""
    fault = only(diagnosis_of(scaled("v", "s", gain=1 / 3.6)))
    assert (fault.channels, fault.serious, fault.is_correctable) == (("v",), True, False)
    assert fault.value == pytest.approx(1 / 3.6) and "3.6 times too small" in fault.text
    assert only(diagnosis_of(scaled("v", "s", gain=1 / 3.6), missing=("ay1", "ay2"))) == fault


@pytest.mark.parametrize(("channel", "size"), [("ay1", 5000.0), ("rf", 30.0), ("d2", 0.5), ("yw", 0.5)])
@pytest.mark.parametrize("missing", [(), ("e1", "e2", "d1")])
def test_single_spikes_are_no_fault_of_the_whole_channel(channel: str, size: float, missing: Sequence[str]) -> None:
    assert diagnosis_of(with_spikes(channel, size, [2000, 3100]), missing=missing).faults == ()


def test_without_relations_the_nominal_model_decides_only_signs_and_units_of_accelerations() -> None:
    missing = ("e1", "e2", "d1", "d2")
    assert only(diagnosis_of(scaled("ay2", gain=-1.0), missing=missing)).channels == ("ay2",)
    assert only(diagnosis_of(scaled("yw", "phiw", gain=-1.0), missing=missing)).channels == ("yw", "phiw")
    assert diagnosis_of(moved_track(0.4), missing=missing).faults == ()


def test_a_correction_restores_the_columns_of_the_fault_it_names() -> None:
    healthy = simulated_campaign().dataset.segments[0]
    plants = (retimed("e1", delay=0.08), scaled("rf", gain=-1.0), with_gravity("ayf", 9.81), moved_track(0.3))
    segment = faulty(*plants).segments[0]
    channels = (Correction("e1", delay=0.08), Correction("rf", gain=-1.0), Correction("ayf", gravity=9.81))
    corrected = corrected_segment(segment, Corrections(channels, {"": 0.3}), 2.56)
    first = int(np.searchsorted(healthy.columns["t"], corrected.columns["t"][0]))
    inner = slice(200, corrected.samples - 200)
    for name in ("e1", "rf", "ayf", "yw"):
        expected = healthy.columns[name][first : first + corrected.samples][inner]
        error = np.abs(corrected.columns[name][inner] - expected).max()
        assert error < 0.02 * healthy.columns[name].std(), name


def test_the_printed_line_keeps_every_key() -> None:
    line = yaml_line(Corrections((Correction("rf", unit="deg/s", runs=("a.csv",)),), {"a.csv": 0.25, "b.csv": -1.0}))
    assert line == "sensors: {rf: {unit: deg/s, runs: [a.csv]}, track_offset: {a.csv: 0.25 m, b.csv: -1 m}}"


def test_a_unit_in_which_a_channel_would_be_impossibly_large_is_no_hypothesis():
    """A yaw rate of 9 mrad/s rms is none of 9 rad/s in thousandths."""
    gains = {h.value for h in discrete_hypotheses(["rf"], rms={"rf": 9e-3}) if h.kind == "unit"}
    assert 1e-3 not in gains and {1e-2, 1e3} <= gains
