"""Stretches made ready for a fit: filtered, weighted, begun, and shortened where a part of them will do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.dataset import (
    Dataset,
    Segment,
    comparison_filter,
    kernel_filter,
    simulate,
    sosfiltfilt_or_demean,
    steps_for,
)
from railui.core import Filter
from railui.identification.estimation.initial_state import estimate_initial_state, state_scale
from railui.identification.estimation.validation import noise_weights
from railui.vehicle.model import Model

WEIGHED = 6  # windows of a stretch whose noise is simulated for the weights of all
NUDGE = 1e-3  # of its usual size by which an initial state is moved for a derivative
RIG_RATE = 400.0  # samples of a rig that count as a second of a vehicle


@dataclass(frozen=True, eq=False)
class InitialStateSensitivity:
    """What the initial state of a window does to its channels: rows [state, channel, n], compared as the rest is."""

    rows: FloatArray
    inverse: FloatArray

    def estimate(self, series: FloatArray) -> FloatArray:
        """The initial states [..., state], in their usual sizes, that make most of series [..., channel, n]."""
        return np.asarray(np.tensordot(series, self.rows, ([-2, -1], [1, 2])) @ self.inverse)

    def project_out(self, series: FloatArray) -> FloatArray:
        """Series [..., channel, n] less what the initial state can make of them."""
        return np.asarray(series - np.tensordot(self.estimate(series), self.rows, 1))


@dataclass(frozen=True, eq=False)
class FitSegment:
    """A stretch made ready for the fit: measured channels filtered and weighted [channel, kept], start, steps."""

    segment: Segment
    filter: Filter
    measured: FloatArray
    initial_state: FloatArray
    steps: int
    initial_sensitivity: InitialStateSensitivity | None = field(default=None, repr=False)
    required_steps: int = 0  # steps that the vehicle asks for, where fewer are taken

    def without_initial_state(self, series: FloatArray) -> FloatArray:
        """Series [..., channel, n] less what a window's own beginning can make of them."""
        return series if self.initial_sensitivity is None else self.initial_sensitivity.project_out(series)

    def trim(self, x: FloatArray) -> FloatArray:
        """Samples [..., n] of the stretch as they are, where it is compared."""
        cut = self.filter.cut
        return np.asarray(x[..., cut : x.shape[-1] - cut : self.filter.every])

    def filter_and_weight(self, x: FloatArray) -> FloatArray:
        """Channels [channel, n] over the stretch as `y` was made of the measured ones: filtered and weighted."""
        return self.trim(sosfiltfilt_or_demean(self.filter.sos, x)) * self.filter.weights[:, None]


def prepare_segments(model: Model, measurement: Dataset, stretches: Sequence[Segment]) -> list[FitSegment]:
    """Stretches prepared for a model: weights from noise and what track noise leaves, initial states estimated."""
    ready, of_whole = [], dict[tuple[str, int], FloatArray]()
    for stretch in stretches:
        campaign = measurement.campaign
        w = weights_of(model, measurement, stretch, of_whole)
        rate = 1.0 / stretch.dt
        every = 1 if campaign.band is None else max(1, int(rate / (2.4 * min(campaign.band[1], 0.45 * rate))))
        y = comparison_filter(campaign, stretch, stretch.measured(stretch.channels))[:, ::every] * w[:, None]
        start = estimate_initial_state(model, stretch, measurement.noise)
        ready.append(
            FitSegment(stretch, kernel_filter(campaign, stretch, w, every), y, start, steps_for(model, stretch))
        )
    return ready


def weights_of(
    model: Model, measurement: Dataset, stretch: Segment, of_whole: dict[tuple[str, int], FloatArray]
) -> FloatArray:
    """The weights of a stretch [channel]; windows share those of some of them."""
    if stretch.window_of is None:
        return noise_weights(model, measurement, stretch)
    key = (stretch.file, stretch.number)
    if key not in of_whole:
        cut = stretch.window_of.windows(stretch.samples * stretch.dt)
        some = [noise_weights(model, measurement, w) for w in cut[:: max(len(cut) // WEIGHED, 1)]]
        of_whole[key] = 1.0 / np.sqrt(np.mean([1.0 / w**2 for w in some], axis=0))
    return of_whole[key]


def estimate_window_start(model: Model, target: FitSegment) -> FitSegment:
    """A window begun anew with a model: its initial state corrected by linear least squares, and what it can do."""
    stretch = target.segment
    scale = state_scale(stretch, model)
    starts = np.tile(target.initial_state, (len(scale) + 1, 1))
    starts[1:, : len(scale)] += np.diag(NUDGE * scale)
    series, lost = simulate(
        model, stretch, stretch.channels, batch=model.batch(np.tile(model.on(*stretch.segment_key).row, (len(starts), 1))),
        steps=target.steps, filter=target.filter, initial=starts,
    )  # fmt: skip
    if np.any(lost >= 0):
        raise ValueError(f"the vehicle diverges on {stretch.file} at {stretch.columns['t'][0]:g} s")
    rows = (series[1:] - series[0]) / NUDGE
    gram = np.tensordot(rows, rows, ([1, 2], [1, 2])) + np.eye(len(rows))
    begun = InitialStateSensitivity(rows, np.asarray(np.linalg.inv(gram), dtype=np.float64))
    start = target.initial_state.copy()
    start[: len(scale)] += scale * begun.estimate(target.measured - series[0])
    return replace(target, initial_state=start, initial_sensitivity=begun)


def adapt_to_model(
    model: Model, ready: Sequence[FitSegment], measurement: Dataset, most: int | None = None
) -> list[FitSegment]:
    """The same comparison for a model of another structure: steps (no more than `most`), initial states if they matter.

    That is where bodies were added, and on a rig, whose ringing lasts as long as its runs.
    """
    out = []
    for t in ready:
        grown = t.segment.kind == "rig" or any(e.kind == "coach_mode" for e in model.effects)
        start = estimate_initial_state(model, t.segment, measurement.noise) if grown else t.initial_state
        needed = max(t.steps, steps_for(model, t.segment))
        steps = needed if most is None else max(t.steps, min(needed, most))
        out.append(replace(t, initial_state=start, steps=steps, required_steps=needed))
    return out


def truncate(ready: Sequence[FitSegment], measurement: Dataset, seconds: float) -> list[FitSegment]:
    """The first seconds of every stretch (of a rig's as many samples), enough to tell candidates apart."""
    out = []
    for t in ready:
        if t.segment.window_of is not None:
            if t.segment.first_sample * t.segment.dt < seconds:
                out.append(t)
            continue
        rate = RIG_RATE if t.segment.kind == "rig" else 1.0 / t.segment.dt
        n = round(seconds * rate)
        if n >= t.segment.samples:
            out.append(t)
            continue
        stretch = t.segment.truncated(n)
        weights, every = t.filter.weights, t.filter.every
        y = comparison_filter(measurement.campaign, stretch, stretch.measured(stretch.channels))[:, ::every]
        short = kernel_filter(measurement.campaign, stretch, weights, every)
        out.append(replace(t, segment=stretch, filter=short, measured=y * weights[:, None]))
    return out


def reprepare_segments(model: Model, ready: Sequence[FitSegment], measurement: Dataset) -> list[FitSegment]:
    """The stretches of a fit with weights and initial states renewed for the adjusted model."""
    return prepare_segments(model, measurement, [t.segment for t in ready])
