"""Equivalent input signals: where a force must act to make the residual, whatever its law (thesis 6.2).

At every frequency the residual of all channels is compared with the answer of the adjusted vehicle to a force at a
place. Used to say where something is missing and to draw it, never to decide that something is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui import core
from railui.arrays import ComplexArray, FloatArray
from railui.campaign.dataset import Dataset, comparison_filter, simulate
from railui.dsp.spectra import hann
from railui.identification.estimation.output_error import Fit, GaussNewton
from railui.identification.estimation.problem import FitSegment
from railui.track import input_table

Port = tuple[str, int | None]  # a place and its wheelset

DRAWS = 4
UNIT, DELAY = 100.0, 4  # N of a pulse, and the samples ahead of it
Pulse = tuple[tuple[float, float], ...]  # samples from its peak, and the force there of 1 N over one sample
# a sum of pulses is the force between its samples: a cubic (Catmull and Rom 1974) at the nodes of RK4, half samples
CUBIC: Pulse = (
    (-2.0, 0.0), (-1.5, -0.0625), (-1.0, 0.0), (-0.5, 0.5625), (0.0, 1.0),
    (0.5, 0.5625), (1.0, 0.0), (1.5, -0.0625), (2.0, 0.0),
)  # fmt: skip
WIDE: Pulse = ((-2.0, 0.0), (0.0, 0.5), (2.0, 0.0))  # passes nothing at half the rate: answers may be thinned out
SEGMENT = 5.12  # seconds of a segment of the spectra
AS_GOOD = 0.03  # a place with fewer forces is taken within so much of the best share
# place in reports, wheelset, the ports at which independent forces act
SPOTS: tuple[tuple[str, int | None, tuple[Port, ...]], ...] = (
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
)


@dataclass(frozen=True)
class Origin:
    """A place and the share of the residual that forces there can make, chance taken off."""

    at: str
    wheelset: int | None
    share: float
    forces: int


def locate_forces(fit: Fit, measurement: Dataset) -> list[Origin]:
    """Places by the share of the residual that independent forces there can make, the likeliest first.

    What sensor noise and track noise leave is taken off the spectra: track noise looks like forces at the contact.
    As many independent forces as channels make any residual, so that a place with so many is left out; no place is
    left where a single channel was measured.
    """
    if fit.model.design.kind != "bogie":
        return [Origin("rig", None, 1.0, 1)]
    adjuster = GaussNewton(fit.model, fit.free, fit.segments, block=1.0, stable=False, jobs=None)
    shares = np.zeros(len(SPOTS))
    # number of stretches with more channels than so many forces
    able = {n: sum(len(t.measured) > n for t in fit.segments) for n in {len(ports) for _, _, ports in SPOTS}}
    for target in fit.segments:
        series, _ = adjuster.simulate(target, fit.x[None])
        residual = target.without_initial_state(target.measured - series[0])
        spectra = _spectra(residual, target) - _noise(fit, target, measurement)
        answers = _answers(fit, target)
        total = float(np.real(np.trace(spectra, axis1=1, axis2=2)).sum())
        channels = len(residual)
        for i, (_, _, ports) in enumerate(SPOTS):
            if len(ports) >= channels:
                continue
            h = np.stack([answers[p] for p in ports], axis=2)
            q, _ = np.linalg.qr(h)
            made = float(np.real(np.einsum("fci,fcd,fdi->", q.conj(), spectra, q)))
            chance = len(ports) / channels
            shares[i] += (made / total - chance) / (1.0 - chance) / able[len(ports)]
    found = [Origin(at, w, float(s), len(p)) for (at, w, p), s in zip(SPOTS, shares, strict=True) if able[len(p)]]
    best = max((o.share for o in found), default=0.0)

    def order(o: Origin) -> tuple[bool, int, float]:
        near = o.share >= best - AS_GOOD
        return not near, o.forces if near else 0, -o.share

    return sorted(found, key=order)


def _spectra(residual: FloatArray, target: FitSegment) -> ComplexArray:
    """Cross spectra [frequency, channel, channel] of the residual."""
    n = _length(target)
    window = hann(n)
    starts = range(0, residual.shape[1] - n + 1, n // 2)
    parts = np.stack([np.fft.rfft(residual[:, k : k + n] * window, axis=1) for k in starts])
    return np.asarray(np.einsum("scf,sdf->fcd", parts, parts.conj()))


def _length(target: FitSegment) -> int:
    """Compared samples of a segment; no more than there are."""
    dt = target.segment.dt * target.filter.every
    return min(round(SEGMENT / dt), int(target.measured.shape[1]))


def _noise(fit: Fit, target: FitSegment, measurement: Dataset) -> ComplexArray:
    """Cross spectra of what noise leaves, the mean of a few draws."""
    noise, campaign, stretch = measurement.noise, measurement.campaign, target.segment
    model, channels = fit.model, stretch.channels
    sd = np.array([noise.get(c, 0.0) for c in channels])
    clean, _ = simulate(model, stretch, channels, steps=target.steps, filter=target.filter, initial=target.initial_state)
    total: ComplexArray = np.zeros((1, 1, 1), dtype=complex)
    for seed in range(DRAWS):
        rng = np.random.default_rng(np.random.SeedSequence([seed, 17, stretch.number, stretch.run_index]))
        table = stretch.noisy_table(noise, campaign.noise_band, rng, model.half_wheelbase(), target.steps)
        noisy, _ = simulate(
            model, stretch, channels, steps=target.steps, filter=target.filter, initial=target.initial_state, table=table
        )
        white = comparison_filter(
            campaign, stretch, sd[:, None] * rng.standard_normal((len(channels), stretch.samples))
        )
        white = white[:, :: target.filter.every] * target.filter.weights[:, None]
        total = total + _spectra(noisy[0] - clean[0] + white, target) / DRAWS
    return np.asarray(total)


def _answers(fit: Fit, target: FitSegment) -> dict[Port, ComplexArray]:
    """Answer [frequency, channel] of the vehicle to a short pulse at each port."""
    ports = sorted({p for _, _, ports in SPOTS for p in ports}, key=str)
    answers = pulses(fit, target, ports, SEGMENT, target.filter.weights, WIDE, target.filter.every)
    return {port: np.fft.rfft(x[:, : _length(target)], axis=1).T + 1e-300 for port, x in answers.items()}


def pulses(
    fit: Fit,
    target: FitSegment,
    ports: Sequence[Port],
    seconds: float,
    weights: FloatArray,
    pulse: Pulse = CUBIC,
    every: int = 1,
) -> dict[Port, FloatArray]:
    """Weighted answer [channel, n] over some seconds, on even track, to a pulse of 1 N over one sample at each port.

    A sample is `every` of the run's; the pulse peaks at sample `DELAY`, run at the mean speed of the stretch. What the
    vehicle does on even track without one is taken off: a wheelset that runs out is never quiet.
    """
    stretch, dt, v = target.segment, target.segment.dt, target.segment.mean_speed
    n = round(seconds / (dt * every)) * every
    t = np.arange(n) * dt
    corners = [v * dt * every * (DELAY + k) for k, _ in pulse]
    force = [UNIT * f for _, f in pulse]
    table = input_table(t, v * t, np.full(n, v), np.zeros(n), None, None, fit.model.half_wheelbase(), target.steps)
    row = core.effect_numbers("measured_force", {"motion": corners, "force": force})
    batch = fit.model.batch(np.tile(fit.model.row, (2, 1)), np.array([row, row]), np.array([[1.0], [0.0]]))
    out: dict[Port, FloatArray] = {}
    for at, wheelset in ports:
        vehicles = fit.model.vehicles((), [core.Placement("measured_force", at, wheelset, len(row), "s")])
        series, _ = vehicles.simulate(batch, table, dt, target.steps, stretch.channels)
        out[at, wheelset] = (series[0] - series[1])[:, ::every] * weights[:, None] / UNIT
    return out
