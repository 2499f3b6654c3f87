"""Equivalent inputs: location of the forces that explain the residual, whatever their law (thesis 6.2).

At every frequency the residual of all channels is compared with the response of the calibrated model to forces at a
location. The result locates a discrepancy; it never decides whether there is one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from railui import core
from railui.arrays import ComplexArray, FloatArray
from railui.campaign.comparison import comparison_filter
from railui.campaign.segment import Segment
from railui.campaign.settings.discrepancy import DiscrepancySettings
from railui.dsp.spectra import hann
from railui.identification.context import Context
from railui.identification.estimation.block_ratio import ratio_standard_error
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.problem import FitSegment
from railui.identification.prediction import DivergedError, Predictor
from railui.identification.structure.locations import JOINT_CLASSES, distinct_locations
from railui.parallel import run_both
from railui.track import input_table
from railui.vehicle.model import Model

Port = tuple[str, int | None]  # location and wheelset of a force
PortsOfLocation = tuple[str, int | None, tuple[Port, ...]]

LOCATION_SEED = 1017  # no number of a draw, with which the noise floor begins its seeds
PULSE_FORCE = 100.0  # N
PULSE_DELAY = 4  # samples before the peak of a pulse
Pulse = tuple[tuple[float, float], ...]  # (samples from the peak, force) of a pulse of 1 N over one sample
# a sum of these pulses interpolates a force by a cubic (Catmull and Rom 1974) at the nodes of RK4, half samples
CUBIC_PULSE: Pulse = (
    (-2.0, 0.0), (-1.5, -0.0625), (-1.0, 0.0), (-0.5, 0.5625), (0.0, 1.0),
    (0.5, 0.5625), (1.0, 0.0), (1.5, -0.0625), (2.0, 0.0),
)  # fmt: skip
WIDE_PULSE: Pulse = ((-2.0, 0.0), (0.0, 0.5), (2.0, 0.0))  # has no content at half the rate, which permits decimation
WINDOW_DURATION = 5.12  # s, window of the spectra
# reported location, wheelset, ports at which independent forces act
FORCE_LOCATIONS: tuple[PortsOfLocation, ...] = (
    ("secondary_lateral", None, (("secondary_lateral", None),)),
    ("secondary_yaw", None, (("secondary_yaw", None),)),
    ("primary_lateral", 1, (("primary_lateral", 1),)),
    ("primary_lateral", 2, (("primary_lateral", 2),)),
    ("primary_lateral", None, (("primary_lateral", 1), ("primary_lateral", 2))),
    ("primary_yaw", 1, (("primary_yaw", 1),)),
    ("primary_yaw", 2, (("primary_yaw", 2),)),
    ("primary_yaw", None, (("primary_yaw", 1), ("primary_yaw", 2))),
    ("contact", 1, (("wheelset", 1), ("wheelset_yaw", 1))),
    ("contact", 2, (("wheelset", 2), ("wheelset_yaw", 2))),
    ("wheelset_yaw", None, (("wheelset_yaw", None),)),
    ("wheelset_yaw", 1, (("wheelset_yaw", 1),)),
    ("wheelset_yaw", 2, (("wheelset_yaw", 2),)),
    ("contact", None, (("wheelset", 1), ("wheelset_yaw", 1), ("wheelset", 2), ("wheelset_yaw", 2))),
    ("wheelset", 1, (("wheelset", 1),)),
    ("wheelset", 2, (("wheelset", 2),)),
    ("frame", None, (("frame", None), ("frame_yaw", None))),
)


class WindowedShare(NamedTuple):
    """Squared residual of a segment less noise, in all and as forces explain it, [window], and the share by chance.

    segment: its number among those of the fit; a location lacks segments with too few channels.
    """

    total: FloatArray
    explained: FloatArray
    chance: float
    segment: int = 0

    @property
    def beyond_chance(self) -> FloatArray:
        """Squared residual [window] that the forces explain beyond chance."""
        return self.explained - self.chance * self.total

    @property
    def not_by_chance(self) -> FloatArray:
        """Squared residual [window] that chance does not explain."""
        return (1.0 - self.chance) * self.total


@dataclass(frozen=True, eq=False)
class ForceLocation:
    """A location, and the share of the residual that its forces explain beyond chance and noise.

    standard_error: that of the share over windows of time; windows: the parts of the share, by segment.
    """

    at: str
    wheelset: int | None
    share: float
    forces: int
    standard_error: float = 0.0
    windows: tuple[WindowedShare, ...] = ()

    @property
    def chance(self) -> float:
        """Share of any residual that so many forces explain, the mean over all windows."""
        chances = [np.full(len(w.total), w.chance) for w in self.windows]
        return float(np.mean(np.concatenate(chances))) if chances else 0.0

    def can_locate(self, settings: DiscrepancySettings) -> bool:
        """True unless so many forces explain most of any residual."""
        return self.chance <= settings.max_chance_share

    def lead(self, other: ForceLocation) -> tuple[float, float]:
        """Return by how much the share exceeds that of another location, and the standard error of that difference.

        The shares of both vary alike from window to window: their difference is known better than either. On segments
        that only one of them has they cannot be compared.
        """
        others = {w.segment: w for w in other.windows}
        both = [(w, others[w.segment]) for w in self.windows if w.segment in others]
        if not both:
            return self.share - other.share, np.inf
        mine, theirs = [w for w, _ in both], [w for _, w in both]
        excess = [a.beyond_chance / (1.0 - a.chance) - b.beyond_chance / (1.0 - b.chance) for a, b in both]
        standard_error = ratio_standard_error(np.concatenate(excess), np.concatenate([a.total for a in mine]))
        return _share(mine) - _share(theirs), standard_error


def locate_forces(context: Context, fit: Fit) -> list[ForceLocation]:
    """Rank locations by the share of the residual that independent forces there explain.

    The contributions of sensor and track noise are subtracted from the spectra, since track noise resembles forces at
    the contact. As many independent forces as channels explain any residual: locations with so many are left out, which
    leaves none if a single channel was measured; those with more than half as many come last and locate nothing. None
    where the residual does not exceed noise significantly, where the vehicle diverges on even track or with every
    realisation of the noise, nor for a rig, which has one place.
    """
    if not fit.model.design.is_on_track:
        return []
    quiet = context.in_background(context.jobs)
    optimiser = GaussNewton.of_fit(quiet, fit)
    candidates = force_locations(fit.model)
    shares: list[list[WindowedShare]] = [[] for _ in candidates]
    for number, target in enumerate(fit.segments):
        try:
            [series] = optimiser.simulate(target, fit.x[None]).converged()
            noise, responses = run_both(
                partial(_noise, context, fit, target),
                partial(_frequency_responses, fit, target, candidates),
                context.jobs,
            )
        except DivergedError as error:
            context.progress.message(f"  forces at no location are compared: {error}")
            return []
        residual = _transforms(target.without_initial_state(target.measured - series), target)
        for i, (_, _, ports) in enumerate(candidates):
            if len(ports) < len(target.measured):
                h = np.stack([responses[p] for p in ports], axis=2)
                shares[i].append(_explained_share(residual, noise, h)._replace(segment=number))
    standard_errors = context.settings.verdict.location_standard_errors
    locations = [
        ForceLocation(at, wheelset, _share(same), len(ports), _standard_error(same), tuple(same))
        for (at, wheelset, ports), same in zip(candidates, shares, strict=True)
        if same and _exceeds_noise(same, standard_errors)
    ]
    settings = context.settings.discrepancy
    best = max((o.share for o in locations if o.can_locate(settings)), default=0.0)

    def key(o: ForceLocation) -> tuple[bool, bool, int, float]:
        is_as_good = o.share >= best - settings.force_location_tolerance
        return not o.can_locate(settings), not is_as_good, o.forces if is_as_good else 0, -o.share

    return sorted(locations, key=key)


def _explained_share(residual: ComplexArray, noise: ComplexArray, responses: ComplexArray) -> WindowedShare:
    """Project the residual [window, channel, frequency] on responses [frequency, channel, port] at each frequency."""
    q, _ = np.linalg.qr(responses)
    count = len(residual)
    total = np.sum(np.abs(residual) ** 2, axis=(1, 2)) - np.real(np.trace(noise, axis1=1, axis2=2)).sum() / count
    projected = np.einsum("fci,wcf->wfi", q.conj(), residual)
    of_noise = float(np.real(np.einsum("fci,fcd,fdi->", q.conj(), noise, q)))
    explained = np.sum(np.abs(projected) ** 2, axis=(1, 2)) - of_noise / count
    return WindowedShare(total, explained, responses.shape[2] / responses.shape[1])


def _share(shares: Sequence[WindowedShare]) -> float:
    """Share of all segments that the forces explain beyond chance; 0 where noise leaves nothing to explain."""
    total = sum(float(s.not_by_chance.sum()) for s in shares)
    return sum(float(s.beyond_chance.sum()) for s in shares) / total if total > 0.0 else 0.0


def _exceeds_noise(shares: Sequence[WindowedShare], standard_errors: float) -> bool:
    """True where the mean over all windows of the squared residual less noise is significantly above zero."""
    totals = np.concatenate([s.total for s in shares])
    return float(totals.mean()) > standard_errors * ratio_standard_error(totals, np.ones(len(totals)))


def _standard_error(shares: Sequence[WindowedShare]) -> float:
    """Standard error of the share: of a ratio over the windows of all segments."""
    explained = np.concatenate([s.beyond_chance for s in shares])
    return ratio_standard_error(explained, np.concatenate([s.not_by_chance for s in shares]))


def _transforms(series: FloatArray, target: FitSegment) -> ComplexArray:
    """Windowed transforms [window, channel, frequency] of half-overlapping windows."""
    n = _length(target)
    window = hann(n)
    starts = range(0, series.shape[1] - n + 1, n // 2)
    return np.stack([np.fft.rfft(series[:, k : k + n] * window, axis=1) for k in starts])


def _spectra(series: FloatArray, target: FitSegment) -> ComplexArray:
    """Cross spectra [frequency, channel, channel] of series [channel, n]."""
    parts = _transforms(series, target)
    return np.asarray(np.einsum("scf,sdf->fcd", parts, parts.conj()))


def _length(target: FitSegment) -> int:
    """Number of compared samples in a window of the spectra."""
    dt = target.segment.dt * target.filter.decimation
    return min(round(WINDOW_DURATION / dt), int(target.measured.shape[1]))


def _noise(context: Context, fit: Fit, target: FitSegment) -> ComplexArray:
    """Cross spectra [frequency, channel, channel] of the noise, the mean of a few draws.

    Raises
    ------
    DivergedError
        Where the vehicle diverges with each of them.
    """
    noise, campaign, segment = context.noise, context.campaign, target.segment
    channels = segment.channels
    predictor = target.predictor(fit.model)
    [clean] = predictor.simulate().converged()
    found: list[ComplexArray] = []
    for seed in range(context.settings.discrepancy.location_noise_draws):
        of_track, of_sensors = _generators(seed, segment)
        table = segment.noisy_table(noise, campaign.noise_band, of_track, fit.model.wheelset_spacing(), target.steps)
        noisy, diverged = predictor.simulate(table=table)
        if diverged[0] >= 0:
            continue
        sensors = comparison_filter(campaign, segment, noise.draw(channels, segment.samples, segment.dt, of_sensors))
        sensors = sensors[:, :: target.filter.decimation] * target.filter.weights[:, None]
        found.append(_spectra(noisy[0] - clean + sensors, target))
    if not found:
        raise DivergedError(f"the vehicle diverges on {segment.file} with every realisation of the noise")
    return np.asarray(np.mean(found, axis=0))


def _generators(draw: int, segment: Segment) -> tuple[np.random.Generator, np.random.Generator]:
    """Generators of the noise of the track, which the windows of a segment share, and of that of their sensors."""
    of_segment = [LOCATION_SEED, draw, segment.number, segment.run_index]
    of_window = [*of_segment, 1 + segment.first_sample]
    return np.random.default_rng(of_segment), np.random.default_rng(of_window)


def force_locations(model: Model) -> tuple[PortsOfLocation, ...]:
    """Return the locations that are compared, each with the ports at which independent forces act."""
    structure = model.design.structure
    if structure is None:
        return FORCE_LOCATIONS
    found: list[PortsOfLocation] = []
    for at in distinct_locations(model):
        location = structure.effect_locations[at]
        ports = tuple((at, n or None) for n in location.numbers)
        if at in ("contact", "track") or at.endswith("_roll"):
            continue
        found += [(at, n, (port,)) for n, port in zip(location.numbers, ports, strict=True) if len(ports) > 1]
        if location.catalogue_name in JOINT_CLASSES or len(ports) == 1:
            found.append((at, None, ports))
    wheels = [w.number for w in structure.wheelsets]
    at_wheels = {n: (("wheelset", n), ("wheelset_yaw", n)) for n in wheels}
    found += [("contact", n, ports) for n, ports in at_wheels.items()]
    return (*found, ("contact", None, tuple(port for ports in at_wheels.values() for port in ports)))


def _frequency_responses(
    fit: Fit, target: FitSegment, locations: Sequence[PortsOfLocation]
) -> dict[Port, ComplexArray]:
    """Frequency response [frequency, channel] of the model to a force at each port."""
    ports = sorted({p for _, _, ports in locations for p in ports}, key=str)
    responses = impulse_responses(
        fit, target.for_differences, ports, WINDOW_DURATION, target.filter.weights, WIDE_PULSE, target.filter.decimation
    )
    return {port: np.fft.rfft(x[:, : _length(target)], axis=1).T + 1e-300 for port, x in responses.items()}


def impulse_responses(
    fit: Fit,
    target: FitSegment,
    ports: Sequence[Port],
    seconds: float,
    weights: FloatArray,
    pulse: Pulse = CUBIC_PULSE,
    every: int = 1,
) -> dict[Port, FloatArray]:
    """Compute weighted responses [channel, n] on even track to a pulse of 1 N over one sample at each port.

    One sample is `every` samples of the run. The pulse peaks at sample PULSE_DELAY; the speed is the mean speed of the
    segment. The motion without the pulse is subtracted: a wheelset with run-out moves on even track, too.
    """
    segment, dt, v = target.segment, target.segment.dt, target.segment.mean_speed
    n = round(seconds / (dt * every)) * every
    t = np.arange(n) * dt
    positions = [v * dt * every * (PULSE_DELAY + k) for k, _ in pulse]
    force = [PULSE_FORCE * f for _, f in pulse]
    table = input_table(t, v * t, np.full(n, v), np.zeros(n), None, None, fit.model.wheelset_spacing(), target.steps)
    row = core.effect_numbers("measured_force", {"motion": positions, "force": force})
    row_on_segment = fit.model.on_segment(*segment.segment_key).row
    batch = fit.model.batch(np.tile(row_on_segment, (2, 1)), np.array([row, row]), np.array([[1.0], [0.0]]))
    predictor = Predictor(fit.model, segment, target.steps)
    responses: dict[Port, FloatArray] = {}
    for at, wheelset in ports:
        vehicles = fit.model.vehicles((), [core.Placement("measured_force", at, wheelset, len(row), "s")])
        series = predictor.simulate(batch=batch, vehicles=vehicles, table=table).converged()
        responses[at, wheelset] = (series[0] - series[1])[:, ::every] * weights[:, None] / PULSE_FORCE
    return responses
