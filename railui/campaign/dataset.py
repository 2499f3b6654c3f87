"""Dataset of a campaign: measured runs cut into unbroken segments, by role."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from railui.campaign.campaign import DEFAULT_BAND, Campaign, RunEntry
from railui.campaign.comparison import MAX_BAND_SHARE
from railui.campaign.corrections.apply import corrected_run
from railui.campaign.faults.waveform import hum_of_rig
from railui.campaign.noise.estimate import estimate_noise_model
from railui.campaign.prescribed_motion import with_motion_bandwidth
from railui.campaign.rig_steps import with_phase_steps
from railui.campaign.segment import Segment
from railui.campaign.sensor_drift import with_drift_removed
from railui.campaign.settings.estimation import ValidationSettings
from railui.campaign.track_datum import with_datum_removed
from railui.io.problems import file_problem
from railui.io.yaml_document import load_yaml
from railui.runs import columns as known
from railui.runs.run import Run, load_run
from railui.track import distance_from_speed
from railui.vehicle.track_geometry import track_geometry


def segments_of_run(
    run: Run,
    name: str,
    role: str,
    kind: known.Form = "bogie",
    index: int = 0,
    unknown_lead: float = 0.0,
    load: str | None = None,
) -> list[Segment]:
    """Cut a run into its usable segments, in their order, each from where the track under all wheelsets is known.

    index: that of the run in the campaign. unknown_lead: distance [m] behind the leading wheelset without a record.
    load: state of the design.
    """
    names = tuple(known.columns_of(kind))
    responses = known.column_names(kind, "response")
    segments = []
    for number, part in enumerate(run.segments):
        columns = {k: np.ascontiguousarray(run.columns[k][part]) for k in names if k in run.columns}
        if kind not in known.RIG_FORMS and "s" not in columns:
            columns["s"] = distance_from_speed(columns["t"], columns["v"])
        usable = {k: x for k, x in columns.items() if k not in responses or np.all(np.isfinite(x))}
        whole = Segment(
            name, role, number, usable, 1.0 / run.rate, kind, run_index=index, unknown_lead=unknown_lead, load=load
        )
        segments.append(whole.on_known_track())
    return segments


class ValidationParts(NamedTuple):
    """Segments of the validation runs that select effects, and those reserved for the test."""

    selection: list[Segment]
    test: list[Segment]


def hold_back(segments: Sequence[Segment], settings: ValidationSettings, rig_rate: float) -> ValidationParts:
    """Reserve the last share of every validation run for the test, where it and the rest are long enough.

    Parameters
    ----------
    settings
        Share of the samples of a run, and the shortest part of a segment that is used.
    rig_rate
        Samples of a rig that count as one second, if that is less [1/s].
    """
    seconds = settings.min_test_duration
    parts = ValidationParts([], [])
    for run in dict.fromkeys(s.run_index for s in segments):
        same = [s for s in segments if s.run_index == run]
        left = round((1.0 - settings.test_share) * sum(s.samples for s in same))  # samples before the reserved part
        for s in same:
            cut, left = min(max(left, 0), s.samples), left - s.samples
            least = seconds / s.dt if not s.is_rig else min(seconds / s.dt, seconds * rig_rate)
            least = max(least, settings.min_test_samples)
            if cut < least:
                whole = parts.test if cut < s.samples - cut and s.samples >= least else parts.selection
                whole.append(s)
            elif s.samples - cut < least:
                parts.selection.append(s)
            else:
                parts.selection.append(s.part(0, cut))
                parts.test.append(s.part(cut, s.samples))
    return parts if parts.selection else ValidationParts(list(segments), [])


@dataclass(frozen=True)
class Dataset:
    """A campaign with its runs: their segments, and the noise of every column; the stated noise is its prior."""

    campaign: Campaign
    runs: tuple[Run, ...]
    segments: tuple[Segment, ...]
    noise: Mapping[str, float]

    @property
    def estimation(self) -> list[Segment]:
        """Segments of the estimation runs."""
        return [s for s in self.segments if s.role == "adjust"]

    @property
    def validation(self) -> list[Segment]:
        """Segments of the validation runs, which no fit uses."""
        return [s for s in self.segments if s.role == "validate"]

    @property
    def selection(self) -> list[Segment]:
        """Segments that accept and remove effects: the validation runs without the part reserved for the test."""
        return self._parts.selection

    @property
    def test(self) -> list[Segment]:
        """Segments of the independent test: test runs, or the reserved part of the validation runs; may be empty."""
        return self._parts.test

    @property
    def has_test_runs(self) -> bool:
        """True where the campaign has runs of role test; otherwise a part of the validation runs is reserved."""
        return any(run.role == "test" for run in self.campaign.runs)

    @cached_property
    def hum(self) -> Mapping[tuple[str, str], float]:
        """Mains hum [Hz] of a rig, by name of the run and channel, as far as it is not corrected."""
        return hum_of_rig(self.segments, self.campaign.settings.faults)

    @cached_property
    def _parts(self) -> ValidationParts:
        if self.has_test_runs:
            return ValidationParts(self.validation, [s for s in self.segments if s.role == "test"])
        settings = self.campaign.settings
        rig_rate = settings.calibration.rig_samples_per_second
        return hold_back(self.validation, settings.validation, rig_rate)


def _check_sampled_band(campaign: Campaign, rate: float) -> None:
    """Raise FileProblems for a band that ends above half the sampling rate [Hz] of every run.

    The default is limited to the sampling rate instead, as is a band on the more slowly sampled of several runs.
    """
    if campaign.band is None or campaign.band == DEFAULT_BAND or campaign.band[1] <= 0.5 * rate:
        return
    findings = load_yaml(campaign.source).findings()
    message = f"its upper limit {campaign.band[1]:g} Hz is above half the sampling rate of the runs, {rate:.4g} Hz"
    findings.add("band", message, f"give at most {MAX_BAND_SHARE * rate:.3g} Hz")
    findings.raise_errors()


def load_campaign_run(campaign: Campaign, entry: RunEntry) -> Run:
    """Read a run of a campaign, with the units that its corrections state in place of those of the header.

    Columns of a rig stay in the unit of their header, which other runs share, and exchanged columns have that of the
    other one: their unit is corrected as a gain.
    """
    kind = campaign.design.run_form
    corrections, _ = campaign.corrections.of_run(entry.name)
    exchanged = {name for c in corrections if c.swap_with is not None for name in (c.channel, c.swap_with)}
    stated = {c.channel: c.unit for c in corrections if c.unit is not None and c.channel not in exchanged}
    return load_run(entry.file, kind, units={} if kind in known.RIG_FORMS else stated)


def read_dataset(campaign: Campaign) -> Dataset:
    """Read the runs of a campaign and make its corrections; FileProblems for a run that cannot be used."""
    kind = campaign.design.run_form
    geometry = track_geometry(campaign.design)
    # the wheelbase of a bogie passes within some samples, a coach within a third of a second
    unknown_lead = 0.0 if geometry.is_bogie or not geometry.distances else geometry.distances[-1]
    runs: list[Run] = []
    segments: list[Segment] = []
    for index, entry in enumerate(campaign.runs):
        run = load_campaign_run(campaign, entry)
        run = corrected_run(run, entry.name, campaign.corrections, geometry.wheelbase)
        if not run.segments:
            raise file_problem(
                entry.file, "has no segment left after its corrections", "check the delays of its columns"
            )
        if campaign.design.is_on_track and not campaign.design.is_on_rollers:
            run = with_datum_removed(run, campaign.settings.noise)
        runs.append(run)
        segments += segments_of_run(run, entry.name, entry.role, kind, index, unknown_lead, entry.load)
    _check_sampled_band(campaign, max(run.rate for run in runs))
    noise = estimate_noise_model(
        segments, campaign.noise, geometry, campaign.band, campaign.noise_band, campaign.settings.noise
    )
    rig_input = campaign.design.rig_input if campaign.design.kind == "rig" else None
    used = with_phase_steps(with_motion_bandwidth(segments, rig_input, campaign.settings.noise))
    if campaign.band is None:
        used = with_drift_removed(used, campaign.settings.noise)
    return Dataset(campaign, tuple(runs), used, noise)
