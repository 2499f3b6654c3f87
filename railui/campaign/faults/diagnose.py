"""Diagnosis of a campaign's data before any fit."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from railui.campaign.corrections.apply import corrected_columns
from railui.campaign.corrections.correction import Corrections, yaml_line
from railui.campaign.dataset import Dataset
from railui.campaign.faults.cross_level import has_reversed_cross_level
from railui.campaign.faults.fault import Diagnosis, Fault, ordered
from railui.campaign.faults.hypotheses import RADIAN, Consistency, G, Hypothesis
from railui.campaign.faults.intermittent import fault_of_part, find_intermittent_fault
from railui.campaign.faults.merge import hypothesis_fault, merged_faults
from railui.campaign.faults.nominal import ModelAgreement, compare_with_nominal, contradicted
from railui.campaign.faults.response import (
    ResponseConsistency,
    ResponseFault,
    find_response_fault,
    find_unit_of_run,
)
from railui.campaign.faults.response_spectra import ResponseSpectra, response_spectra, vehicle_rows
from railui.campaign.faults.rig_faults import faults_of_rig
from railui.campaign.faults.scores import is_consistent, is_evident, total_misfit
from railui.campaign.faults.search import FaultSearch, Transform
from railui.campaign.faults.spectra import RunSpectra, run_spectra
from railui.campaign.faults.waveform import waveform_faults
from railui.campaign.faults.wording import fault_text
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from railui.io.units import MAX_PLAUSIBLE_SPEED, UnitError, parse_unit
from railui.parallel import map_threads
from railui.runs.columns import COLUMNS
from railui.runs.plausibility import without_spikes
from railui.vehicle.model import Model
from railui.vehicle.track_geometry import track_geometry

FOLLOWING = ("ay1", "ay2", "ayf", "rf")  # channels that follow the track at long wavelengths, for any vehicle
NAMED_UNITS = {"m/s^2": {"g": 1.0 / G}, "rad/s": {"deg/s": RADIAN}, "rad": {"deg": RADIAN}}  # gain where SI is stated
KMH = 3.6  # km/h in a m/s
TRACK_COLUMNS = ("yw", "phiw")
RESPONSE = "response to the track of vehicles about the nominal model"


def diagnose(dataset: Dataset, jobs: int | None = 1) -> Diagnosis:
    """Find the smallest set of faulty channels that explains all contradictions of the data.

    The kinematic relations between the channels decide, which hold for any vehicle; samples of single channels show
    clipping, dropouts and hum; where no relation includes the track, the response of the vehicle to it decides. A
    channel that contradicts the others during a part of a run is left out of all later comparisons of that run.

    Parameters
    ----------
    dataset : Dataset
        The measured runs, with the corrections that the campaign already makes.
    jobs : int or None
        Number of threads; None for all.

    Returns
    -------
    Diagnosis
        All faults; `serious` are those with which no fit should begin.
    """
    settings = dataset.campaign.settings.faults
    is_on_track = dataset.campaign.design.is_on_track
    if is_on_track and (speed := _implausible_speed(dataset)) is not None:
        return ordered([speed])  # all that depends on the speed would be blamed on the sensors
    if is_on_track and (distance := _contradictory_distance(dataset)) is not None:
        return ordered([distance])  # likewise
    radius = track_geometry(dataset.campaign.design).rolling_radius if is_on_track else None
    waveform = waveform_faults(dataset.segments, settings, radius)
    unusable = {f.channels[0] for f in waveform if f.serious and f.kind != "hum"}
    usable = [_without(s, unusable) for s in dataset.segments]
    if is_on_track:
        usable = [_without_spikes(s) for s in usable]
    runs = {e.name: [s for s in usable if s.file == e.name] for e in dataset.campaign.runs}
    runs = {name: segments for name, segments in runs.items() if segments and segments[0].channels}
    if is_on_track and (speed := _speed_in_another_unit(dataset, runs)) is not None:
        return ordered([speed])
    faults = _faults_by_relations(dataset, runs, jobs)
    intermittent = _intermittent_faults(dataset, runs, faults)
    if any(f.serious for f in intermittent):
        runs = {name: _without_faulty(segments, name, intermittent) for name, segments in runs.items()}
        means = {(*f.channels, *f.files) for f in intermittent}  # over the whole run, of a track column
        faults = [f for f in _faults_by_relations(dataset, runs, jobs) if (*f.channels, *f.files) not in means]
    if is_on_track:
        faults += _faults_by_response(dataset, runs, faults, jobs)
        faults += _faults_against_model(dataset, runs, faults)
        faults += _reversed_cross_level(dataset, runs, faults)
    else:
        faults = faults_of_rig(dataset, runs, faults)
    # only reading applies a named unit, each search needs its gain
    return ordered([_with_named_unit(fault, dataset) for fault in (*faults, *intermittent, *waveform)])


def _faults_by_relations(dataset: Dataset, runs: Mapping[str, Sequence[Segment]], jobs: int | None) -> list[Fault]:
    """Find the faults by the kinematic relations between the channels."""
    settings = dataset.campaign.settings.faults
    searches = {
        name: FaultSearch(settings, _transform(dataset, segments), _has_units(dataset), _rms(segments))
        for name, segments in runs.items()
    }
    found = zip(searches, map_threads(FaultSearch.find, list(searches.values()), jobs), strict=True)
    return [_unresolved(f, searches) for f in merged_faults(dict(found), searches, settings)]


def _intermittent_faults(
    dataset: Dataset, runs: Mapping[str, Sequence[Segment]], faults: Sequence[Fault]
) -> list[Fault]:
    """Find the faults during a part of a run, one channel after another, with the other faults corrected."""
    settings, corrections = dataset.campaign.settings.faults, ordered(faults).corrections
    intermittent: list[Fault] = []
    for name, segments in runs.items():
        remaining = list(segments)
        while len(intermittent) < settings.max_faults * len(runs):
            spectra = _transform(dataset, remaining)(corrections)
            found = None if spectra is None else find_intermittent_fault(spectra, settings, len(runs))
            if found is None:
                break
            intermittent.append(fault_of_part(found, name, float(remaining[0].columns["t"][0]), settings))
            if found.channel in TRACK_COLUMNS:
                break
            remaining = [_without(s, {found.channel}) for s in remaining]
    return intermittent


def _without_faulty(segments: Sequence[Segment], run: str, faults: Sequence[Fault]) -> list[Segment]:
    """Return the segments of a run without responses that have a serious fault there."""
    faulty = {f.channels[0] for f in faults if f.serious and run in f.files and f.channels[0] not in TRACK_COLUMNS}
    return [_without(s, faulty) for s in segments]


def _implausible_speed(dataset: Dataset) -> Fault | None:
    """Return the fault of a speed that no train reaches.

    Reading computes distances with it, so that the header has to state its unit and no correction can.
    """
    speeds: dict[str, float] = {}
    for name in dict.fromkeys(s.file for s in dataset.segments):
        v = np.concatenate([s.columns["v"] for s in dataset.segments if s.file == name])
        speeds[name] = float(np.median(v))
    files = tuple(name for name, speed in speeds.items() if speed > MAX_PLAUSIBLE_SPEED)
    if not files:
        return None
    text = f"v is {max(speeds.values()):.4g} m/s in the median, faster than trains run"
    remedy = "write `v [km/h]` in the header if it is in km/h"
    return Fault("unit", ("v",), None, None, "1", files, text, True, Corrections(), remedy=remedy)


def _contradictory_distance(dataset: Dataset) -> Fault | None:
    """Return the fault of distances that differ from the integral of the speed: t, v or s is wrong."""
    lengths: dict[str, tuple[float, float]] = {}
    for name in dict.fromkeys(s.file for s in dataset.segments):
        parts = [s.columns for s in dataset.segments if s.file == name]
        driven = sum(float(np.trapezoid(c["v"], c["t"])) for c in parts)
        lengths[name] = sum(float(c["s"][-1] - c["s"][0]) for c in parts), driven
    tolerance = dataset.campaign.settings.faults.serious_distance_error
    files = tuple(name for name, (covered, driven) in lengths.items() if abs(covered - driven) > tolerance * driven)
    if not files:
        return None
    covered, driven = lengths[files[0]]
    text = f"s covers {covered:.6g} m where v gives {driven:.6g} m in the time t"
    remedy = "correct the unit of t, v or s in the header (s, m/s, m), or leave s out if it is the wrong one"
    return Fault("unit", ("s",), None, None, "1", files, text, True, Corrections(), remedy=remedy)


def _speed_in_another_unit(dataset: Dataset, runs: Mapping[str, Sequence[Segment]]) -> Fault | None:
    """Return the fault of a speed with which the trailing wheelset meets the track at a wrong time; v and s agree."""
    found = {name: _factor_of_speed(dataset, segments) for name, segments in runs.items()}
    factor = max((f for f in found.values() if f is not None), default=None)
    if factor is None:
        return None
    files = tuple(name for name, each in found.items() if each == factor)
    size = f"{KMH:g} times too {'small' if factor > 1.0 else 'large'}"
    text = f"the speed is {size}: the trailing wheelset meets the track at another time than v and s say"
    remedy = "correct the unit of v, and of s where it is recorded, in the header"
    return Fault("unit", ("v",), 1.0 / factor, None, "1", files, text, True, Corrections(), remedy=remedy)


def _factor_of_speed(dataset: Dataset, segments: Sequence[Segment]) -> float | None:
    """Return the factor of units by which the channels of a run agree with its speed, and much less without it."""
    given = _transform(dataset, segments)(Corrections())
    if given is None:
        return None
    recorded = Consistency(given)
    return next((f for f in (KMH, 1.0 / KMH) if _fits_speed(dataset, segments, recorded, f)), None)


def _fits_speed(dataset: Dataset, segments: Sequence[Segment], recorded: Consistency, factor: float) -> bool:
    """Return whether the channels of a run agree with a multiple of its speed, and much less with its speed."""
    settings = dataset.campaign.settings.faults
    scaled = [
        replace(s, columns={**s.columns, **{c: factor * s.columns[c] for c in "vs"}}, tables={}) for s in segments
    ]
    other = _transform(dataset, scaled)(Corrections())
    if other is None:
        return False
    supposed = Consistency(other)
    evidence = total_misfit(recorded) - total_misfit(supposed)
    is_better = is_evident(Hypothesis("unit", ("v",), 1.0 / factor), evidence, recorded, settings)
    if not is_better or not is_consistent(supposed, settings):
        return False
    corrections = ordered(_faults_by_relations(dataset, {segments[0].file: segments}, 1)).corrections
    corrected = _transform(dataset, segments)(corrections)  # a track that is recorded elsewhere, for instance
    rival = total_misfit(recorded if corrected is None else Consistency(corrected))
    return rival - total_misfit(supposed) > settings.min_fault_evidence


def _without(segment: Segment, channels: set[str]) -> Segment:
    """Return the segment without channels."""
    if not channels & set(segment.columns):
        return segment
    return replace(segment, columns={k: x for k, x in segment.columns.items() if k not in channels}, tables={})


def _without_spikes(segment: Segment) -> Segment:
    """Return the segment with its spikes smoothed, which reading reports: one sample changes every frequency."""
    names = {*segment.channels, *segment.input_columns}
    smooth = {name: without_spikes(segment.columns[name]) for name in names}
    if all(x is segment.columns[name] for name, x in smooth.items()):
        return segment
    return replace(segment, columns={**segment.columns, **smooth}, tables={})


def _geometry(dataset: Dataset) -> tuple[float, float]:
    """Wheelbase and rolling radius [m]; 1 on a rig."""
    geometry = track_geometry(dataset.campaign.design)
    return (geometry.wheelbase, geometry.rolling_radius) if dataset.campaign.design.is_on_track else (1.0, 1.0)


def _transform(dataset: Dataset, segments: Sequence[Segment]) -> Transform:
    """Return the function that computes the spectra of a run with corrections."""
    wheelbase, radius = _geometry(dataset)

    def transform(corrections: Corrections) -> RunSpectra | None:
        return run_spectra([corrected_segment(s, corrections, wheelbase) for s in segments], wheelbase, radius)

    return transform


def corrected_segment(segment: Segment, corrections: Corrections, wheelbase: float) -> Segment:
    """Return a segment with corrected columns, cut to the samples that every record covers."""
    if not corrections:
        return segment
    channels, offset = corrections.of_run(segment.file)
    start = float(segment.columns["t"][0])
    columns, (first, last) = corrected_columns(segment.columns, channels, offset, wheelbase, start)
    rows = slice(first, segment.samples - last)
    return replace(segment, columns={k: x[rows] for k, x in columns.items()}, tables={})


def _rms(segments: Sequence[Segment]) -> dict[str, float]:
    """Standard deviation of every channel of a run."""
    common = set.intersection(*(set(s.channels) for s in segments))
    return {c: max(float(np.std(s.columns[c])) for s in segments) for c in sorted(common)}


def _has_units(dataset: Dataset) -> bool:
    """True if the columns have physical units; on a rig they may be volts of any scale."""
    if dataset.campaign.design.is_on_track:
        return True
    try:
        labels = [run.units.get(c, "") for run in dataset.runs for c in run.responses]
        derivatives = {"z": "m", "vz": "m/s", "az": "m/s^2"}
        columns = [c for run in dataset.runs for c in run.responses]
        return all(
            label and c in derivatives and parse_unit(label).is_compatible(parse_unit(derivatives[c]))
            for c, label in zip(columns, labels, strict=True)
        )
    except UnitError:
        return False


def _unresolved(fault: Fault, searches: dict[str, FaultSearch]) -> Fault:
    """Return a fault as a mere note where its correction leaves the data contradictory: then it explains nothing.

    Sample times that jitter, for instance, make a motion contradict its acceleration, and no unit cures that.
    """
    open_ones = [name for name in fault.files if not searches[name].is_resolved]
    if not fault.serious or not open_ones:
        return fault
    text = f"the channels contradict each other, and no correction makes them agree; closest: {fault.text}"
    return replace(fault, text=text, serious=False, corrections=Corrections(), alternatives=())


def _with_named_unit(fault: Fault, dataset: Dataset) -> Fault:
    """Return a fault whose correction names the unit of the numbers, if there is a name and the headers state SI."""
    column = COLUMNS.get(fault.channels[0])
    if fault.kind != "unit" or column is None or not fault.corrections or fault.value is None:
        return fault
    headers = {run.units.get(column.name) for run in dataset.runs}
    units = NAMED_UNITS.get(column.unit, {})
    unit = next((u for u, gain in units.items() if np.isclose(gain, fault.value, rtol=2e-3)), None)
    if unit is None or headers != {column.unit}:
        return fault
    channels = tuple(replace(c, gain=1.0, unit=unit) for c in fault.corrections.channels)
    return replace(fault, corrections=Corrections(channels))


def _has_wheelset_displacement(segment: Segment) -> bool:
    return any(re.fullmatch(r"e\d+", c) for c in segment.channels)


def _faults_by_response(
    dataset: Dataset, runs: dict[str, list[Segment]], faults: Sequence[Fault], jobs: int | None
) -> list[Fault]:
    """Find faults of a bogie without relation to the track, one after another, by its response to the track."""
    longest = [max(parts, key=lambda s: s.samples) for parts in runs.values()]
    segments = [s for s in longest if s.kind == "bogie" and not s.is_free and not _has_wheelset_displacement(s)]
    names = [c for c in FOLLOWING if all(c in s.columns for s in segments)]
    if not segments or not names:
        return []
    settings, (wheelbase, radius) = dataset.campaign.settings.faults, _geometry(dataset)
    model = Model(dataset.campaign.design, dataset.campaign.sensors)
    rows = vehicle_rows(settings, model, dataset.campaign.estimated_parameters)
    found: list[Fault] = []
    while len(found) < settings.max_faults:
        corrections = ordered([*faults, *found]).corrections
        corrected = [corrected_segment(s, corrections, wheelbase) for s in segments]
        spectra = map_threads(lambda s: response_spectra(model, rows, s, names, wheelbase, radius), corrected, jobs)
        usable = {c.file: s for c, s in zip(corrected, spectra, strict=True) if s is not None}
        best, only = _response_fault(usable, names, settings, jobs)
        if best is None:
            break
        alternatives = tuple(yaml_line(h.corrections(only)) for h in best.alternatives)
        fault = hypothesis_fault(best.hypothesis, only or tuple(runs), bool(only), alternatives, None, settings)
        found.append(replace(fault, text=f"{fault.text} (by the {RESPONSE})"))
        if not fault.corrections or alternatives:
            break
    return found


def _response_fault(
    spectra: dict[str, ResponseSpectra], names: Sequence[str], settings: FaultSettings, jobs: int | None
) -> tuple[ResponseFault | None, tuple[str, ...]]:
    """Return the clearest fault by the response, and the run alone that has it: a unit that differs between runs."""
    runs = list(spectra.values())
    if not runs:
        return None, ()
    of_run = find_unit_of_run(runs, names, settings)
    if of_run is not None:
        return of_run[1], (list(spectra)[of_run[0]],)
    return find_response_fault(ResponseConsistency(runs, names, jobs), settings), ()


def _faults_against_model(dataset: Dataset, runs: dict[str, list[Segment]], faults: Sequence[Fault]) -> list[Fault]:
    """Find signs and units that only the nominal model can decide: of accelerations without a relation to the track."""
    model = Model(dataset.campaign.design, dataset.campaign.sensors)
    settings = dataset.campaign.settings.faults
    found: dict[str, list[tuple[str, ModelAgreement]]] = {}
    corrections = ordered(faults).corrections
    wheelbase = _geometry(dataset)[0]
    for name, segments in runs.items():
        if segments[0].kind == "bogie" or _has_wheelset_displacement(segments[0]):
            continue  # the response or relations with the track decide
        for segment in segments[:1]:
            corrected = corrected_segment(segment, corrections, wheelbase)
            for agreement in compare_with_nominal(model, corrected, _following(segment), settings):
                found.setdefault(agreement.channel, []).append((name, agreement))
    contradictions: dict[str, Hypothesis] = {}
    of_runs: list[Fault] = []
    for channel, checks in found.items():
        hypotheses = [contradicted(agreement, settings) for _, agreement in checks]
        h = next((h for h in hypotheses if h is not None), None)
        if h is not None and set(hypotheses) == {h}:
            contradictions[channel] = h
        elif h is not None and h.kind == "unit" and set(hypotheses) == {h, None}:
            names = tuple(run for (run, _), x in zip(checks, hypotheses, strict=True) if x is not None)
            of_runs.append(_fault_against_model(h, names, names))
    files = tuple(runs)
    all_opposed = set(contradictions) == set(found) and all(h.kind == "sign" for h in contradictions.values())
    if len(found) >= settings.min_opposed_channels and all_opposed:
        recorded = tuple(c for c in TRACK_COLUMNS if any(np.any(s.columns.get(c, 0.0)) for s in dataset.segments))
        track = _fault_against_model(Hypothesis("sign", recorded, -1.0), files)
        alone = yaml_line(Hypothesis("sign", ("yw",), -1.0).corrections())
        return [replace(track, alternatives=(alone,) if len(recorded) > 1 else ())]
    return [*of_runs, *(_fault_against_model(h, files) for h in contradictions.values())]


def _reversed_cross_level(dataset: Dataset, runs: dict[str, list[Segment]], faults: Sequence[Fault]) -> list[Fault]:
    """Find a cross-level that the motion of every run contradicts, where no fault of the track is known."""
    if any(set(fault.channels) & set(TRACK_COLUMNS) for fault in faults):
        return []
    model = Model(dataset.campaign.design, dataset.campaign.sensors)
    corrections, wheelbase = ordered(faults).corrections, _geometry(dataset)[0]
    firsts = [corrected_segment(segments[0], corrections, wheelbase) for segments in runs.values()]
    signs = {has_reversed_cross_level(dataset.campaign.settings.faults, model, s) for s in firsts} - {None}
    if signs != {True}:
        return []
    h = Hypothesis("sign", ("phiw",), -1.0)
    text = f"{fault_text(h)}; the motion that it causes has the opposite sign in the nominal model"
    return [Fault(h.kind, h.channels, h.value, None, "1", tuple(runs), text, True, h.corrections())]


def _following(segment: Segment) -> list[str]:
    """List the measured accelerations and yaw rates of wheelsets and bogie frame.

    They follow the track at long wavelengths for any vehicle; a body on soft springs does not.
    """
    return [c for c in segment.channels if c in FOLLOWING or re.fullmatch(r"ay\d+", c)]


def _fault_against_model(h: Hypothesis, files: tuple[str, ...], only: tuple[str, ...] = ()) -> Fault:
    """Return a hypothesis as a fault; only: runs to which its correction is restricted."""
    text = f"{fault_text(h)} (against the nominal model at wavelengths above those of the vehicle's own motion)"
    return Fault(h.kind, h.channels, h.value, None, "1", files, text, True, h.corrections(only))
