"""Cross-coupling forces: forces at two locations, each proportional to the motion of the other.

No effect of the library has this form. Every symmetric coupling by stiffness or damping is a candidate that is never
added to the model: it rules out an effect that only imitates it, and locates an inclined arm, a cross-bracing or the
like.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.dsp.filters import frequency_response
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.problem import FitSegment
from railui.identification.prediction import DivergedError
from railui.identification.structure.equivalent_inputs import PULSE_DELAY, WINDOW_DURATION, Port, impulse_responses
from railui.identification.structure.score_test import ScoreTest

LEADING: tuple[Port, ...] = (("wheelset", 1), ("wheelset_yaw", 1))
TRAILING: tuple[Port, ...] = (("wheelset", 2), ("wheelset_yaw", 2))
FRAME: tuple[Port, ...] = (("frame", None), ("frame_yaw", None))
COORDINATES = (*LEADING, *TRAILING, *FRAME)
ARMS = tuple(((("primary_lateral", w), ("primary_yaw", w)),) for w in (1, 2))  # between a wheelset and the frame

Pair = tuple[Port, Port]


@dataclass(frozen=True, eq=False)
class Coupling:
    """Coupled pairs of locations, by displacement (z) or velocity (v), and the share of the residual they explain.

    before, after: squared residual [block] without and with the coupling.
    """

    pairs: tuple[Pair, ...]
    against: str
    share: float
    before: FloatArray
    after: FloatArray

    @property
    def at(self) -> str:
        """First location."""
        return self.pairs[0][0][0]

    @property
    def wheelset(self) -> int | None:
        """Wheelset of the coupling, None if it acts on both or none."""
        wheelsets = {w for pair in self.pairs for _, w in pair if w is not None}
        return wheelsets.pop() if len(wheelsets) == 1 else None

    @property
    def text(self) -> str:
        """Coupled locations in words."""
        (a, i), (b, j) = self.pairs[0]
        both = " on both wheelsets" if len(self.pairs) > 1 else ""
        return f"{_words(a, i if not both else None)} with {_words(b, j if not both else None)}{both}"


def _words(at: str, wheelset: int | None) -> str:
    return at + (f" {wheelset}" if wheelset else "")


def candidate_couplings() -> list[tuple[Pair, ...]]:
    """List every pair of coordinates, and the pairs of the two primary suspensions of a wheelset."""
    between = [((a, b),) for i, a in enumerate(COORDINATES) for b in COORDINATES[i + 1 :]]
    return [*between, *ARMS, (*ARMS[0], *ARMS[1])]


def find_couplings(context: Context, fit: Fit) -> list[Coupling]:
    """Rank symmetric couplings by the share of the residual that they explain beyond the estimated parameters."""
    if not fit.model.design.has_wheelset_equations or any(t.is_window for t in fit.segments):
        return []
    couplings = [(pairs, q) for q in ("z", "v") for pairs in candidate_couplings()]
    test = ScoreTest(context, fit, fit.segments)
    try:
        scores = test.score([coupling_responses(fit, t, couplings) for t in fit.segments])
    except DivergedError as error:
        context.progress.message(f"  no couplings are compared: {error}")
        return []
    shares = np.where(scores.is_distinguishable, scores.rho**2, 0.0)
    before = test.projector.block_products[:, 0, 0]
    amount = scores.amount[:, None]
    after = before - (2.0 * amount * scores.scores - amount**2 * scores.block_norms)
    results = [
        Coupling(pairs, q, float(share), before, left)
        for (pairs, q), share, left in zip(couplings, shares, after, strict=True)
    ]
    return sorted(results, key=lambda c: -c.share)


def coupling_responses(fit: Fit, target: FitSegment, couplings: Sequence[tuple[tuple[Pair, ...], str]]) -> FloatArray:
    """Compute the output differences [coupling, channel, n] of couplings, to first order.

    A coupling of locations a and b applies a force q_b at a and q_a at b, where q is the displacement or velocity of
    the vehicle without the coupling. The output is their convolution with the impulse responses h to a force:

        difference = sum over the pairs of  h_a * q_b + h_b * q_a

    Source: unmodelled forces as equivalent input signals (Broersen 1976, 6.2), here of known law; to first order, since
    q is the motion without the coupling (Born approximation).

    couplings: pairs of locations, and the motion "z" (displacement) or "v" (velocity).
    """
    ports = sorted({p for pairs, _ in couplings for pair in pairs for p in pair}, key=str)
    responses = impulse_responses(fit, target, ports, WINDOW_DURATION, target.filter.weights)
    channels = [f"{q}.{at}.{w or 0}" for q in ("z", "v") for at, w in ports]
    [motion] = target.motion_predictor(fit.model).simulate(channels).converged()
    n = motion.shape[1]
    size = 1 << (n + next(iter(responses.values())).shape[1] - 1).bit_length()
    gain = _zero_phase_gain(target.filter.sos, size)
    spectra = {p: np.fft.rfft(a, size, axis=1) for p, a in responses.items()}
    motions = {c: gain * np.fft.rfft(x, size) for c, x in zip(channels, motion, strict=True)}
    compared = slice(PULSE_DELAY + target.filter.trim, PULSE_DELAY + n - target.filter.trim, target.filter.decimation)
    differences = np.zeros((len(couplings), *target.measured.shape))
    for i, (pairs, q) in enumerate(couplings):
        total = np.zeros_like(next(iter(spectra.values())))
        for (a, u), (b, w) in pairs:
            total += spectra[a, u] * motions[f"{q}.{b}.{w or 0}"] + spectra[b, w] * motions[f"{q}.{a}.{u or 0}"]
        differences[i] = np.fft.irfft(total, size, axis=1)[:, compared]
    return differences


def _zero_phase_gain(sos: FloatArray, size: int) -> FloatArray:
    """Gain of the zero-phase comparison filter at the frequencies of a transform of `size` samples."""
    if not len(sos):
        return np.ones(size // 2 + 1)
    return np.abs(frequency_response(sos, 2 * np.pi * np.arange(size // 2 + 1) / size)) ** 2
