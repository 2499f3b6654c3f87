"""Runs that have not been made yet, simulated with the nominal model as the data set of a campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.campaign import Campaign, RunEntry
from railui.campaign.dataset import Dataset
from railui.campaign.noise.model import white_noise
from railui.campaign.segment import Segment
from railui.core import Spline
from railui.identification.prediction import Predictor
from railui.track import parse_spec
from railui.track.excitation import TrackSource, is_track_file, resolve_track
from railui.vehicle.model import Model

SAMPLING_RATE = 200.0  # Hz
SPARE_LENGTH = 10.0  # m of a synthetic track beyond the longest run


@dataclass(frozen=True, eq=False)
class PlannedRun:
    """A run at a constant speed [m/s] for a duration [s] on a track, from a distance [m] behind its start.

    load: state in which the vehicle runs; None: that of its design.
    """

    speed: float
    duration: float
    source: TrackSource
    name: str
    start: float = 0.0
    load: str | None = None

    @property
    def length(self) -> float:
        """Distance [m]."""
        return self.speed * self.duration


def planned_runs(
    speeds: Sequence[float],
    tracks: Sequence[str | Path],
    duration: float,
    seed: int | None = None,
    sections: int = 1,
    loads: Sequence[str] = (),
) -> list[PlannedRun]:
    """Return a run for every speed [m/s] on every section of every track, in every load state.

    A synthetic track is made as long as the fastest run on each of its sections.

    Parameters
    ----------
    tracks : sequence of str or Path
        Specs of synthetic tracks, or files.
    seed : int, optional
        Seed that replaces that of the specs.
    sections : int
        Places along each track from which a run may start, equally spaced from its start on.
    loads : sequence of str
        Load states of the design; none: that in which it is.

    Raises
    ------
    FileProblems
        For a faulty file.
    ValueError
        For a faulty spec, a line with curves, and a recorded track that is shorter than a run.
    """
    runs = []
    for track in tracks:
        source = _long_enough(track, sections * max(speeds) * duration + SPARE_LENGTH, seed)
        if source.track.has_curves:
            raise ValueError(f"{source.name} has curves: plan runs on tangent track, which the loop needs")
        for speed, label in _speed_labels(speeds).items():
            runs += _runs_on(source, speed, label, duration, sections, source.name if len(tracks) > 1 else "")
    return [replace(run, load=load, name=f"{run.name}, {load}") for load in loads for run in runs] if loads else runs


def _speed_labels(speeds: Sequence[float]) -> dict[float, str]:
    """Return every speed [m/s] as text, to four digits unless two of them would be alike, since they name runs.

    >>> _speed_labels([20.0, 140 / 3.6]), _speed_labels([30.001, 30.002])
    ({20.0: '20 m/s', 38.888888888888886: '38.89 m/s'}, {30.001: '30.001 m/s', 30.002: '30.002 m/s'})
    """
    short = {speed: f"{speed:.4g} m/s" for speed in speeds}
    return short if len(set(short.values())) == len(short) else {speed: f"{speed:.9g} m/s" for speed in speeds}


def _runs_on(
    source: TrackSource, speed: float, label: str, duration: float, sections: int, track: str
) -> list[PlannedRun]:
    """Return the runs at a speed on the sections of a track; `track`: its name where there are several."""
    length = speed * duration
    if length > source.track.length:
        longest = source.track.length / speed
        raise ValueError(
            f"{source.name} is {source.track.length:.0f} m long, {duration:g} s at {label} are {length:.0f} m: "
            f"plan at most {longest:.0f} s"
        )
    starts = np.linspace(0.0, source.track.length - length, sections) if sections > 1 else np.zeros(1)
    found = []
    for start in starts.tolist():
        place = f"{start:.0f} to {start + length:.0f} m" if sections > 1 else ""
        name = ", ".join(part for part in (label, place, track) if part)
        found.append(PlannedRun(float(speed), duration, source, name, start))
    return found


def _long_enough(track: str | Path, length: float, seed: int | None) -> TrackSource:
    """Return the track of an argument; a synthetic one has at least a length [m]."""
    if is_track_file(track):
        return resolve_track(track)
    spec = parse_spec(str(track))
    spec = spec if seed is None else replace(spec, seed=seed)
    longer = np.ceil(max(length, spec.length) / spec.spacing) * spec.spacing
    return resolve_track(str(replace(spec, length=float(longer))))


def simulate_runs(
    campaign: Campaign, model: Model, runs: Sequence[PlannedRun], channels: Sequence[str], role: str = "adjust"
) -> Dataset:
    """Simulate runs with a model, without noise, as the data set of a campaign.

    Parameters
    ----------
    campaign
        Noise, band and thresholds of the planned campaign; its runs are replaced.
    channels
        Sensors that are recorded.

    Raises
    ------
    ValueError
        Where the vehicle diverges.
    """
    entries = tuple(RunEntry(Path(run.name), role, run.name) for run in runs)
    segments = tuple(_simulate(model, run, i, campaign, channels, role) for i, run in enumerate(runs))
    campaign = replace(campaign, runs=entries)
    return Dataset(campaign, (), segments, white_noise(campaign.noise))


def _simulate(
    model: Model, run: PlannedRun, index: int, campaign: Campaign, channels: Sequence[str], role: str
) -> Segment:
    columns = _track_columns(run)
    responses = {c: np.zeros_like(columns["t"]) for c in channels}
    dt = 1.0 / SAMPLING_RATE
    kind = campaign.design.run_form
    segment = Segment(run.name, role, 0, {**columns, **responses}, dt, kind, run_index=index)
    series, diverged = Predictor(model, segment).simulate()
    if diverged[0] >= 0:
        raise ValueError(f"the vehicle diverges at {run.speed:.4g} m/s")
    measured: Mapping[str, FloatArray] = dict(zip(segment.channels, series[0], strict=True))
    return replace(segment, columns={**columns, **measured}, tables={})


def _track_columns(run: PlannedRun) -> dict[str, FloatArray]:
    """Return clock and track columns of a run, sampled at equal times."""
    t: FloatArray = np.arange(int(run.duration * SAMPLING_RATE)) / SAMPLING_RATE
    track = run.source.track
    s = track.s[0] + run.start + run.speed * t
    irregularities = {"yw": track.yw, "phiw": track.phiw, "gauge": track.gauge}
    sampled = {name: Spline(track.s, values)(s) for name, values in irregularities.items()}
    return {"t": t, "s": s, "v": np.full_like(t, run.speed), **sampled}
