"""Segment of a measured run: its columns, channels and input tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.core import Spline
from railui.dsp.filters import butterworth, sosfiltfilt
from railui.runs import columns as known
from railui.track import Wheelbase, add_track, band_limited_noise, run_table

COACH_FORCES = known.column_names("bogie", "coach")
TRACK_COLUMNS = known.column_names("bogie", "track")
CARBODY_FORCES = {"Qy": "secondary_lateral", "Qpsi": "secondary_yaw"}  # and the location whose forces they replace
MOTION_FILTER_ORDER = 4  # of the low-pass of a noisy prescribed motion, forwards and backwards
MIN_WINDOW_SAMPLES = 28  # more than the comparison filter extends a series by
MAX_SHARED_STEPS = 2  # per sample, up to which a truncated segment takes its rows from the table of the full one


class SegmentKey(NamedTuple):
    """Full segment of a run: run and number, distance [m] of its middle, and load state (None: the design's)."""

    name: str
    middle: float
    load: str | None = None


def smooth_motion(x: FloatArray, limit: float, dt: float) -> FloatArray:
    """Filter a prescribed motion [n] forwards and backwards through the low-pass with an edge [Hz]."""
    return np.asarray(sosfiltfilt(butterworth(MOTION_FILTER_ORDER, [limit], 1.0 / dt), x))


@dataclass(frozen=True, eq=False)
class Segment:
    """An unbroken part of a measured run.

    Attributes
    ----------
    number
        Index among the segments of its run.
    columns
        Measured columns [n] by name, in SI units.
    dt
        Time between samples [s].
    tables
        Cache of the input tables by half-wheelbase and number of steps.
    window_of
        The segment from which this window was cut.
    truncation_of
        The segment of which this is a part.
    first_sample
        Index of the first sample of a window or a part in the segment from which it was cut.
    run_index
        Index of the run in the campaign.
    unknown_lead
        Distance [m] behind the leading wheelset over which the track is not known at the start of the run.
    load
        Load state of the vehicle; None: that of its design.
    motion_bandwidth
        Edge [Hz] of the low-pass of prescribed motions of a rig, by column, where noise would distort their speed.
    drift_limit
        Edge [Hz] of the high-pass of a free decay whose sensors drift; 0: none.
    least_steps
        Integration steps per sample, at least.
    """

    file: str
    role: str
    number: int
    columns: Mapping[str, FloatArray]
    dt: float
    kind: known.Form = "bogie"
    tables: dict[tuple[Wheelbase, int], FloatArray] = field(default_factory=dict, repr=False)
    window_of: Segment | None = None
    first_sample: int = 0
    truncation_of: Segment | None = None
    run_index: int = 0
    unknown_lead: float = 0.0
    load: str | None = None
    motion_bandwidth: Mapping[str, float] = field(default_factory=dict)
    drift_limit: float = 0.0
    least_steps: int = 1

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.columns["t"])

    @property
    def is_rig(self) -> bool:
        """True for a test bench, with a free mass or with prescribed motion."""
        return self.kind in known.RIG_FORMS

    @property
    def is_free(self) -> bool:
        """True for the motion of a vehicle without any excitation by the track: the decay of an initial offset."""
        return not self.is_rig and not any(np.any(self.columns[c]) for c in TRACK_COLUMNS if c in self.columns)

    @property
    def abscissa(self) -> FloatArray:
        """Distance along the track [m]; of a rig, the time of its record [s]."""
        return self.columns["t" if self.is_rig else "s"]

    @property
    def channels(self) -> list[str]:
        """Names of the measured responses."""
        return [c for c in known.column_names(self.kind, "response") if c in self.columns]

    @property
    def input_columns(self) -> tuple[str, ...]:
        """Names of the columns that drive the vehicle: of the track, or the input of a rig, as far as measured."""
        return tuple(c for c in known.column_names(self.kind, "track") if c in self.columns)

    @property
    def is_driven(self) -> bool:
        """True where an input column is not zero throughout; of a window: of the segment of which it is a part."""
        columns = (self.window_of or self).columns
        return any(np.any(columns[c]) for c in self.input_columns)

    @property
    def coach_forces(self) -> tuple[str, ...]:
        """Names of the measured forces of the carbody, which are inputs of the model."""
        return tuple(q for q in COACH_FORCES if q in self.columns)

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest speed [m/s]; 1 on a rig."""
        if self.is_rig:
            return 1.0, 1.0
        if self.window_of is not None:
            return self.window_of.speeds
        return float(self.columns["v"].min()), float(self.columns["v"].max())

    @property
    def mean_speed(self) -> float:
        """Mean speed [m/s]; 1 on a rig."""
        return 1.0 if self.is_rig else float(self.columns["v"].mean())

    @property
    def segment_key(self) -> SegmentKey:
        """Run and number of the full segment, the distance [m] of its middle, and the load state."""
        source = self.window_of or self.truncation_of
        if source is not None:
            return source.segment_key
        s = self.columns.get("s")
        middle = 0.0 if s is None else float(0.5 * (s[0] + s[-1]))
        return SegmentKey(f"{self.run_index}.{self.number}", middle, self.load)

    def table(self, half_wheelbase: Wheelbase, steps: int) -> FloatArray:
        """Return the input table of the segment for a number of RK4 steps per sample, cached."""
        key = (half_wheelbase, steps)
        if key not in self.tables:
            is_shared = steps <= MAX_SHARED_STEPS or self._starts_inside
            source = self.window_of or (self.truncation_of if is_shared else None)
            self.tables[key] = (
                self._input_table(self.columns, half_wheelbase, steps)
                if source is None
                else self.window_rows(source.table(half_wheelbase, steps), steps)
            )
        return self.tables[key]

    @property
    def _starts_inside(self) -> bool:
        """True where the track behind its first sample is that of a longer segment."""
        return self.first_sample > 0 or (self.truncation_of is not None and self.truncation_of._starts_inside)

    def truncated(self, samples: int) -> Segment:
        """Return the segment cut after its first samples."""
        return self.part(0, samples)

    def part(self, start: int, stop: int) -> Segment:
        """Return the samples from `start` to before `stop` as a segment, on the track of this one."""
        columns = {k: np.ascontiguousarray(x[start:stop]) for k, x in self.columns.items()}
        first = start if self.window_of is None else self.first_sample + start
        return replace(self, columns=columns, tables={}, truncation_of=self, first_sample=first)

    def on_known_track(self) -> Segment:
        """Return the part in which the track under every wheelset is recorded.

        Until the last wheelset has come to where the record begins it meets a track that nobody has measured.
        """
        first = self._first_known()
        return replace(self.part(first, self.samples), unknown_lead=0.0) if first else self

    def windows(self, seconds: float) -> list[Segment]:
        """Cut the segment into windows of at least a length [s] that share its track, from where it is known on.

        A window of a slowly sampled run is longer where the comparison filter would need more samples.
        """
        first = self._first_known()
        known_samples = self.samples - first
        count = max(min(int(known_samples * self.dt / seconds), known_samples // MIN_WINDOW_SAMPLES), 1)
        edges = np.linspace(first, self.samples, count + 1).astype(int)
        return [
            replace(
                self,
                columns={k: np.ascontiguousarray(x[a:b]) for k, x in self.columns.items()},
                tables={},
                window_of=self,
                first_sample=int(a),
            )
            for a, b in pairwise(edges)
        ]

    def _first_known(self) -> int:
        """First sample at which the track under the last wheelset is known."""
        if not self.unknown_lead:
            return 0
        s = self.columns["s"]
        return min(int(np.searchsorted(s, s[0] + self.unknown_lead)), self.samples // 2)

    def window_rows(self, table: FloatArray, steps: int) -> FloatArray:
        """Select the rows of this window from a table of the full segment."""
        start, last = self.first_sample, self.first_sample + self.samples - 1
        return np.ascontiguousarray(table[2 * steps * start : 2 * steps * last + 1])

    def _input_table(self, c: Mapping[str, FloatArray], half_wheelbase: Wheelbase, steps: int) -> FloatArray:
        if self.is_rig:
            return _rig_table(self._without_motion_noise(c), self.dt, steps)
        return run_table(c, half_wheelbase, steps)[0]

    def noisy_table(
        self, noise: Mapping[str, float], band: float, rng: np.random.Generator, half_wheelbase: Wheelbase, steps: int
    ) -> FloatArray:
        """Return the input table with random noise on its track columns, or on the input of a rig.

        noise: standard deviation per column; band: shortest wavelength of the track noise [m]. The noise of a rig's
        input is white from sample to sample, as that of its sensors.
        """
        return self.table_with_noise(self.draw_input_noise(noise, band, rng), half_wheelbase, steps)

    def draw_input_noise(
        self, noise: Mapping[str, float], band: float, rng: np.random.Generator
    ) -> dict[str, FloatArray]:
        """Draw the noise of the input columns, each [n]; of a window: that of the segment of which it is a part."""
        if self.window_of is not None:
            return self.window_of.draw_input_noise(noise, band, rng)
        if self.is_rig:
            return {c: noise[c] * rng.standard_normal(self.samples) for c in self.input_columns if noise.get(c)}
        noisy = [name for name in TRACK_COLUMNS if noise.get(name) and name in self.columns]
        return {name: band_limited_noise(rng, self.columns["s"], noise[name], band) for name in noisy}

    def table_with_noise(self, drawn: Mapping[str, FloatArray], half_wheelbase: Wheelbase, steps: int) -> FloatArray:
        """Return the input table with noise as `draw_input_noise` returns it."""
        if self.window_of is not None:
            return self.window_rows(self.window_of.table_with_noise(drawn, half_wheelbase, steps), steps)
        if not self.is_rig:
            realisations = [drawn.get(name) for name in TRACK_COLUMNS]
            return add_track(self.table(half_wheelbase, steps), self.columns["s"], realisations, half_wheelbase)
        if not drawn:
            return self.table(half_wheelbase, steps)
        noisy = {c: self.columns[c] + x for c, x in drawn.items()}
        return _rig_table(self._without_motion_noise({**self.columns, **noisy}), self.dt, steps)

    def _without_motion_noise(self, columns: Mapping[str, FloatArray]) -> Mapping[str, FloatArray]:
        """Return the columns of a rig, its noisy prescribed motions below their low-pass."""
        smooth = {c: smooth_motion(columns[c], limit, self.dt) for c, limit in self.motion_bandwidth.items()}
        return {**columns, **smooth}

    def measured(self, channels: Sequence[str]) -> FloatArray:
        """Measured channels [channel, n]."""
        return np.stack([self.columns[c] for c in channels])


def _rig_table(c: Mapping[str, FloatArray], dt: float, steps: int) -> FloatArray:
    """Tabulate t, 1, u, u', u'' at half steps, u a cubic spline in time; of a bench z, its speed as measured, z''."""
    n = len(c["t"])
    at = np.arange(2 * steps * (n - 1) + 1) * (dt / (2 * steps))
    table = np.zeros((len(at), 5))
    table[:, 0], table[:, 1] = at, 1.0
    driving = c.get("u", c["z"] if "F" in c else None)
    if driving is not None:
        spline = Spline(np.arange(n) * dt, driving)
        table[:, 2], table[:, 3], table[:, 4] = spline(at), spline(at, 1), spline(at, 2)
    if "F" in c and "vz" in c:
        spline = Spline(np.arange(n) * dt, c["vz"])
        table[:, 3], table[:, 4] = spline(at), spline(at, 1)
    return table
