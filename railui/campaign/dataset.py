"""Measured runs cut into unbroken stretches, and what is compared of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.campaign import Campaign
from railui.core import Batch, Filter, Spline, Vehicles
from railui.dsp.filters import butterworth, padlen, sosfilt_zi, sosfiltfilt
from railui.dsp.spectra import welch
from railui.runs import columns as known
from railui.runs.run import Run, load_run
from railui.track import Behind, band_limited_noise, distance, run_table, with_track
from railui.vehicle.model import Model

COMPARED = known.COMPARED
RESPONSES = known.named("bogie", "response")
RIG_RESPONSES = known.named("rig", "response")
COACH = known.named("bogie", "coach")
TRACK = known.named("bogie", "track")
SHARED = 2  # steps per sample up to which the whole has a table anyhow, of which a beginning takes its part


@dataclass(frozen=True, eq=False)
class Segment:
    """An unbroken piece of a measured run: columns [n] each, dt [s] between samples."""

    file: str
    role: str
    number: int
    columns: Mapping[str, FloatArray]
    dt: float
    kind: str = "bogie"
    tables: dict[tuple[Behind, int], FloatArray] = field(default_factory=dict, repr=False)
    whole: Segment | None = None  # what a window was cut from, and its first sample there
    first: int = 0
    longer: Segment | None = None  # of which this is the beginning
    run: int = 0  # which of the campaign's

    @property
    def samples(self) -> int:
        """How many samples it has."""
        return len(self.columns["t"])

    @property
    def channels(self) -> list[str]:
        """The responses that were measured here."""
        responses = RIG_RESPONSES if self.kind == "rig" else RESPONSES
        return [c for c in responses if c in self.columns]

    @property
    def coach_forces(self) -> tuple[str, ...]:
        """Measured forces of the coach, which drive the model."""
        return tuple(q for q in COACH if q in self.columns)

    @property
    def speeds(self) -> tuple[float, float]:
        """Slowest and fastest [m/s]."""
        if self.kind == "rig":
            return 1.0, 1.0
        if self.whole is not None:
            return self.whole.speeds
        return float(self.columns["v"].min()), float(self.columns["v"].max())

    @property
    def mean_speed(self) -> float:
        """Mean of the speed [m/s]; 1 on a rig, which stands."""
        return 1.0 if self.kind == "rig" else float(self.columns["v"].mean())

    @property
    def segment_key(self) -> tuple[str, float]:
        """Which run and which of its stretches this is (part of), and the distance [m] of that stretch's middle."""
        cut_from = self.whole or self.longer
        if cut_from is not None:
            return cut_from.segment_key
        s = self.columns.get("s")
        return f"{self.run}.{self.number}", 0.0 if s is None else float(0.5 * (s[0] + s[-1]))

    def table(self, half_wheelbase: Behind, steps: int) -> FloatArray:
        """The input table of this stretch, made once for each number of steps."""
        key = (half_wheelbase, steps)
        if key not in self.tables:
            cut_from = self.whole or (self.longer if steps <= SHARED else None)
            self.tables[key] = (
                self._table(self.columns, half_wheelbase, steps)
                if cut_from is None
                else self._part(cut_from.table(half_wheelbase, steps), steps)
            )
        return self.tables[key]

    def truncated(self, samples: int) -> Segment:
        """The first samples of this stretch."""
        columns = {k: np.ascontiguousarray(x[:samples]) for k, x in self.columns.items()}
        return replace(self, columns=columns, tables={}, longer=self)

    def windows(self, seconds: float) -> list[Segment]:
        """This stretch cut into windows of at least so many seconds, on the track that the whole lies on."""
        edges = np.linspace(0, self.samples, max(int(self.samples * self.dt / seconds), 1) + 1).astype(int)
        return [
            replace(
                self,
                columns={k: np.ascontiguousarray(x[a:b]) for k, x in self.columns.items()},
                tables={},
                whole=self,
                first=int(a),
            )
            for a, b in pairwise(edges)
        ]

    def _part(self, table: FloatArray, steps: int) -> FloatArray:
        """The rows of a table of the whole that belong to this window."""
        return np.ascontiguousarray(table[2 * steps * self.first : 2 * steps * (self.first + self.samples - 1) + 1])

    def _table(self, c: Mapping[str, FloatArray], half_wheelbase: Behind, steps: int) -> FloatArray:
        if self.kind == "rig":
            return _rig_table(c, self.dt, steps)
        return run_table(c, half_wheelbase, steps)[0]

    def noisy_table(
        self, noise: Mapping[str, float], band: float, rng: np.random.Generator, half_wheelbase: Behind, steps: int
    ) -> FloatArray:
        """The table with noise of the declared standard deviations on its track columns, or on the input of a rig.

        A rig has no track: noise on its input is white from sample to sample, as that of its sensors is.
        """
        if self.whole is not None:
            return self._part(self.whole.noisy_table(noise, band, rng, half_wheelbase, steps), steps)
        if self.kind == "rig":
            return self._noisy_rig_table(noise.get("u", 0.0), rng, half_wheelbase, steps)
        s = self.columns["s"]
        drawn = [
            band_limited_noise(rng, s, noise[q], band) if noise.get(q) and q in self.columns else None for q in TRACK
        ]
        return with_track(self.table(half_wheelbase, steps), s, drawn, half_wheelbase)

    def _noisy_rig_table(self, sd: float, rng: np.random.Generator, half_wheelbase: Behind, steps: int) -> FloatArray:
        u = self.columns.get("u")
        if u is None or not sd:
            return self.table(half_wheelbase, steps)
        return _rig_table({**self.columns, "u": u + sd * rng.standard_normal(len(u))}, self.dt, steps)

    def measured(self, channels: Sequence[str]) -> FloatArray:
        """Measured channels [channel, n]."""
        return np.stack([self.columns[c] for c in channels])


def _rig_table(c: Mapping[str, FloatArray], dt: float, steps: int) -> FloatArray:
    """Columns t, 1, u, u', u'' at half steps, u a cubic spline in time."""
    n = len(c["t"])
    at = np.arange(2 * steps * (n - 1) + 1) * (dt / (2 * steps))
    table = np.zeros((len(at), 5))
    table[:, 0], table[:, 1] = at, 1.0
    if "u" in c:
        spline = Spline(np.arange(n) * dt, c["u"])
        table[:, 2], table[:, 3], table[:, 4] = spline(at), spline(at, 1), spline(at, 2)
    return table


def segments_of_run(run: Run, name: str, role: str, kind: str = "bogie", index: int = 0) -> list[Segment]:
    """The stretches of a run that are used, in their order; index: which of the campaign's runs it is."""
    names = tuple(known.columns_of(kind))
    found = []
    for number, piece in enumerate(run.stretches):
        columns = {k: np.ascontiguousarray(run.columns[k][piece]) for k in names if k in run.columns}
        if kind != "rig" and "s" not in columns:
            columns["s"] = distance(columns["t"], columns["v"])
        usable = {k: x for k, x in columns.items() if k not in RESPONSES or np.all(np.isfinite(x))}
        found.append(Segment(name, role, number, usable, 1.0 / run.rate, kind, run=index))
    return found


@dataclass(frozen=True)
class Dataset:
    """A campaign with its runs read: stretches by role, noise of every column (declared, or estimated)."""

    campaign: Campaign
    runs: tuple[Run, ...]
    stretches: tuple[Segment, ...]
    noise: Mapping[str, float]

    @property
    def estimation(self) -> list[Segment]:
        """What is fitted."""
        return [s for s in self.stretches if s.role == "adjust"]

    @property
    def validation(self) -> list[Segment]:
        """What no fit sees, and judges."""
        return [s for s in self.stretches if s.role == "validate"]


def read_dataset(campaign: Campaign) -> Dataset:
    """Read the runs of a campaign. Raises FileProblems for a run that cannot be used."""
    kind = campaign.design.kind
    runs, found = [], []
    for index, entry in enumerate(campaign.runs):
        run = load_run(entry.file, kind)
        runs.append(run)
        found += segments_of_run(run, entry.name, entry.role, kind, index)
    noise = dict(estimated_noise(found)) | dict(campaign.noise)
    return Dataset(campaign, tuple(runs), tuple(found), noise)


def estimated_noise(found: Sequence[Segment]) -> dict[str, float]:
    """White sensor noise of each response from the highest tenth of its spectrum; track columns: none."""
    noise: dict[str, list[float]] = {}
    for s in found:
        for c in s.channels:
            _, power = welch(s.columns[c], 1.0, 1024)
            top = power[-max(len(power) // 10, 1) : -1]
            noise.setdefault(c, []).append(float(np.sqrt(np.median(top) * 0.5)))
    return {c: float(np.median(values)) for c, values in noise.items()}


def band_pass(band: tuple[float, float] | None, rate: float) -> FloatArray:
    """Sections of the Butterworth band-pass of the comparison; none for a band of None."""
    if band is None:
        return np.zeros((0, 6))
    high = min(band[1], 0.45 * rate)
    return butterworth(4, (band[0], high), rate)


def cut_samples(campaign: Campaign, stretch: Segment) -> int:
    """Samples left out at both ends; a window, which begins anew, is compared up to its ends."""
    return 0 if stretch.whole is not None else round(campaign.cut_of(stretch.samples * stretch.dt) / stretch.dt)


def kernel_filter(campaign: Campaign, stretch: Segment, weights: FloatArray, every: int = 1) -> Filter:
    """The comparison's filter of a stretch; weights [channel]."""
    sos = band_pass(campaign.band, 1.0 / stretch.dt)
    return Filter(sos, sosfilt_zi(sos), padlen(sos), cut_samples(campaign, stretch), weights, every)


def comparison_filter(campaign: Campaign, stretch: Segment, x: FloatArray) -> FloatArray:
    """The comparison as defined: each channel [channel, n] forwards and backwards through the band-pass, then cut."""
    cut = cut_samples(campaign, stretch)
    return sosfiltfilt_or_demean(band_pass(campaign.band, 1.0 / stretch.dt), x)[..., cut : x.shape[-1] - cut]


def sosfiltfilt_or_demean(sos: FloatArray, x: FloatArray) -> FloatArray:
    """What sections pass forwards and backwards of each channel [channel, n]; without any, x less its mean."""
    return np.asarray(sosfiltfilt(sos, x) if len(sos) else x - x.mean(axis=-1, keepdims=True))


def simulate(
    model: Model,
    stretch: Segment,
    channels: Sequence[str],
    *,
    batch: Batch | None = None,
    vehicles: Vehicles | None = None,
    steps: int | None = None,
    table: FloatArray | None = None,
    filter: Filter | None = None,
    initial: FloatArray | None = None,
    jobs: int | None = 1,
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Series [vehicle, channel, n] of one or many vehicles over a stretch, and where each diverged (-1: never).

    The one vehicle of a model has the phases that are known of the stretch.
    """
    vehicles = vehicles or model.vehicles(stretch.coach_forces)
    batch = model.on(*stretch.segment_key).single() if batch is None else batch
    if initial is not None:
        batch = batch.with_initial(initial)
    steps = steps or steps_for(model, stretch)
    table = stretch.table(model.half_wheelbase(), steps) if table is None else table
    return vehicles.simulate(batch, table, stretch.dt, steps, channels, filter=filter, jobs=jobs)


def steps_for(model: Model, stretch: Segment) -> int:
    """RK4 steps per sample that the vehicle needs on this stretch."""
    return model.vehicles(stretch.coach_forces).steps(model.single(), *stretch.speeds, stretch.dt)[0]


def nrmse(pairs: Sequence[tuple[Sequence[str], FloatArray, FloatArray]]) -> dict[str, float]:
    """Per channel sqrt(sum (x - z)^2 / sum x^2) over all stretches; pairs of (channels, measured, simulated)."""
    error: dict[str, float] = {}
    power: dict[str, float] = {}
    for channels, x, z in pairs:
        for i, c in enumerate(channels):
            error[c] = error.get(c, 0.0) + float(np.sum((x[i] - z[i]) ** 2))
            power[c] = power.get(c, 0.0) + float(np.sum(x[i] ** 2))
    return {c: float(np.sqrt(error[c] / power[c])) if power[c] > 0 else float("nan") for c in error}


def overall(channels: Mapping[str, float]) -> float:
    """Root of the mean of the squares over the compared channels."""
    used = [v for c, v in channels.items() if c in COMPARED or c in RIG_RESPONSES]
    return float(np.sqrt(np.mean(np.square(used)))) if used else float("nan")
