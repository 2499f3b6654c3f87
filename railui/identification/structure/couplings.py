"""Couplings: forces between two places that answer each other's motion, which no entry of the catalogue makes.

Every symmetric pair of stiffness or damping between two places is a candidate that is never added: it exposes an
effect that stands in for it, and says where a slanting arm, a cross-bracing or the like must act.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.dataset import simulate
from railui.dsp.filters import frequency_response
from railui.identification.estimation.output_error import Fit
from railui.identification.estimation.problem import FitSegment
from railui.identification.structure.equivalent_inputs import DELAY, SEGMENT, Port, pulses
from railui.identification.structure.score_test import ScoreTest

LEADING: tuple[Port, ...] = (("wheelset", 1), ("wheelset_yaw", 1))
TRAILING: tuple[Port, ...] = (("wheelset", 2), ("wheelset_yaw", 2))
FRAME: tuple[Port, ...] = (("frame", None), ("frame_yaw", None))
COORDINATES = (*LEADING, *TRAILING, *FRAME)
ARMS = tuple(((("primary_lateral", w), ("primary_yaw", w)),) for w in (1, 2))  # of one wheelset against the frame


Pair = tuple[Port, Port]


@dataclass(frozen=True)
class Coupling:
    """Pairs of places coupled in one, per displacement (z) or rate (v), and the share of the residual explained."""

    pairs: tuple[Pair, ...]
    against: str
    share: float

    @property
    def at(self) -> str:
        """The place named first."""
        return self.pairs[0][0][0]

    @property
    def wheelset(self) -> int | None:
        """The wheelset where all of it is on one."""
        met = {w for pair in self.pairs for _, w in pair if w is not None}
        return met.pop() if len(met) == 1 else None

    @property
    def text(self) -> str:
        """The coupled places in words."""
        (a, i), (b, j) = self.pairs[0]
        both = " on both wheelsets" if len(self.pairs) > 1 else ""
        return f"{_words(a, i if not both else None)} with {_words(b, j if not both else None)}{both}"


def _words(at: str, wheelset: int | None) -> str:
    return at + (f" {wheelset}" if wheelset else "")


def tried() -> list[tuple[Pair, ...]]:
    """Every pair of co-ordinates, and what couples a wheelset's two primary suspensions."""
    between = [((a, b),) for i, a in enumerate(COORDINATES) for b in COORDINATES[i + 1 :]]
    return [*between, *ARMS, (*ARMS[0], *ARMS[1])]


def find_couplings(fit: Fit) -> list[Coupling]:
    """Symmetric couplings by the share of the residual that they explain beyond the adjustable parameters."""
    if fit.model.design.kind != "bogie" or any(t.segment.window_of is not None for t in fit.segments):
        return []
    eye = ScoreTest(fit, fit.segments)
    what = tried()
    against = [(pairs, q) for q in ("z", "v") for pairs in what]
    seen = eye.against([answered(fit, t, against) for t in fit.segments])
    share = np.where(seen.told, seen.rho**2, 0.0)
    found = [Coupling(pairs, q, float(s)) for (pairs, q), s in zip(against, share, strict=True)]
    return sorted(found, key=lambda c: -c.share)


def answered(fit: Fit, target: FitSegment, against: Sequence[tuple[tuple[Pair, ...], str]]) -> FloatArray:
    """Output differences [coupling, channel, n] of couplings, to first order in them.

    A coupling of places a and b puts a force q_b at a and q_a at b, q the displacement or rate there of the vehicle
    without it; its output is their convolution with the answers h to a pulse of force:

        answer = sum over the pairs of  h_a * q_b + h_b * q_a

    Source: what is missing as an equivalent input signal (Broersen 1976, 6.2), here of known law; to first order, since
    q is that of the vehicle without it (Born's approximation).
    """
    ports = sorted({p for pairs, _ in against for pair in pairs for p in pair}, key=str)
    answers = pulses(fit, target, ports, SEGMENT, target.filter.weights)
    channels = [f"{q}.{at}.{w or 0}" for q in ("z", "v") for at, w in ports]
    motion = simulate(fit.model, target.segment, channels, steps=target.steps, initial=target.initial_state)[0][0]
    n = motion.shape[1]
    size = 1 << (n + next(iter(answers.values())).shape[1] - 1).bit_length()
    band = _passed(target.filter.sos, size)
    spectra = {p: np.fft.rfft(a, size, axis=1) for p, a in answers.items()}
    driving = {c: band * np.fft.rfft(x, size) for c, x in zip(channels, motion, strict=True)}
    kept = slice(DELAY + target.filter.cut, DELAY + n - target.filter.cut, target.filter.every)
    out = np.zeros((len(against), *target.measured.shape))
    for i, (pairs, q) in enumerate(against):
        total = np.zeros_like(next(iter(spectra.values())))
        for (a, u), (b, w) in pairs:
            total += spectra[a, u] * driving[f"{q}.{b}.{w or 0}"] + spectra[b, w] * driving[f"{q}.{a}.{u or 0}"]
        out[i] = np.fft.irfft(total, size, axis=1)[:, kept]
    return out


def _passed(sos: FloatArray, size: int) -> FloatArray:
    """What the zero-phase filter of the comparison passes at the frequencies of a transform of so many samples."""
    if not len(sos):
        return np.ones(size // 2 + 1)
    return np.abs(frequency_response(sos, 2 * np.pi * np.arange(size // 2 + 1) / size)) ** 2
