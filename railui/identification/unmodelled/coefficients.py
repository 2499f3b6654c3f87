"""Estimation of the sixteen coefficients of y_i, y_i', psi_i, psi_i' in the wheelset equations.

Together with the wheel-rail parameters they are the most that measured motions can determine (thesis 3.4, table 3.1).
A coefficient that contradicts its derivation indicates the equation in which a term is missing. A deviation delta acts
as a force -delta times the motion on the wheelset; its sensitivity is the response to that force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.block_products import block_gram
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.problem import FitSegment
from railui.identification.structure.equivalent_inputs import PULSE_DELAY, impulse_responses
from railui.identification.structure.projection import Projector

PORTS = tuple((at, w) for w in (1, 2) for at in ("wheelset", "wheelset_yaw"))
TERMS = ("y", "y'", "psi", "psi'")
UNITS = {
    ("wheelset", "y"): "N/m",
    ("wheelset", "y'"): "N*s/m",
    ("wheelset", "psi"): "N/rad",
    ("wheelset", "psi'"): "N*s/rad",
    ("wheelset_yaw", "y"): "N",
    ("wheelset_yaw", "y'"): "N*s",
    ("wheelset_yaw", "psi"): "N*m/rad",
    ("wheelset_yaw", "psi'"): "N*m*s/rad",
}


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of a wheelset equation and its deviation from the derived value.

    Attributes
    ----------
    equation
        "lateral" or "yaw".
    motion
        The motion that the coefficient multiplies: y, y', psi or psi'.
    difference, sd
        Deviation from the derived value and its standard deviation, in `unit`.
    share
        Share of the squared residual that estimating this coefficient explains.
    contradiction_sd
        Standard deviations from which the coefficient contradicts its derivation.
    """

    wheelset: int
    equation: str
    motion: str
    difference: float
    sd: float
    unit: str
    share: float
    contradiction_sd: float

    @property
    def t(self) -> float:
        """Deviation from the derived value in standard deviations."""
        return self.difference / self.sd if self.sd > 0 else 0.0

    @property
    def contradicts_derivation(self) -> bool:
        """True if the deviation indicates a missing term in the equation."""
        return abs(self.t) > self.contradiction_sd


def estimate_coefficients(context: Context, fit: Fit) -> list[Coefficient]:
    """Estimate each of the sixteen coefficients together with the estimated parameters, in descending order of share.

    The estimate is of first order, at the mean speed of each segment. Raises ValueError for other vehicles.
    """
    if not fit.model.design.has_wheelset_equations:
        raise ValueError("--coefficients needs the equations of two wheelsets and a frame: leave it out")
    settings = context.settings.coefficients
    background = context.in_background(1)
    optimiser = GaussNewton.of_fit(background, fit)
    grams = []
    for target in fit.segments:
        base = optimiser.sensitivities(target, fit.x).converged()
        rows = np.concatenate(
            [base, target.without_initial_state(coefficient_responses(fit, target, settings.pulse_duration))]
        )
        grams.append(block_gram(rows, fit.block_samples(target)).sum(axis=1))
    gram = np.concatenate(grams)
    parameters = 1 + len(fit.x)
    own, added = slice(0, parameters), slice(parameters, None)
    projector = Projector(gram[:, own, own], fit.free, fit.x, fit.normal.variance)
    norms = np.einsum("bii->bi", gram)[:, added]
    scores = projector.project(gram[:, added, own], norms, context.settings.score_test.min_remaining_share)
    coefficients = []
    for lane, (wheelset, at, term) in enumerate((w, at, term) for at, w in PORTS for term in TERMS):
        if not scores.is_distinguishable[lane]:
            continue  # from the estimated parameters
        score = scores.block_score(lane)
        # the deviation counts in standard deviations of a normal variable, however few the blocks
        difference, sd = score.amount, abs(score.amount / score.z) if score.z else np.inf
        share = float(scores.rho[lane] ** 2)
        equation = "yaw" if at.endswith("yaw") else "lateral"
        unit = UNITS[at, term]
        coefficients.append(
            Coefficient(wheelset, equation, term, difference, sd, unit, share, settings.contradiction_sd)
        )
    return sorted(coefficients, key=lambda c: -c.share)


def coefficient_responses(fit: Fit, target: FitSegment, duration: float) -> FloatArray:
    """Weighted output per unit of each coefficient [16, channel, n]: the response to minus the motion as a force."""
    segment = target.segment
    motions = [f"{q}.{at}.{w}" for w in (1, 2) for at in ("wheelset", "wheelset_yaw") for q in ("z", "v")]
    [series] = target.motion_predictor(fit.model).simulate(motions).converged()
    by_wheelset: dict[int | None, FloatArray] = {1: series[:4], 2: series[4:]}  # y, y', psi, psi'
    rows, n = [], segment.samples
    weights = np.ones(len(segment.channels))
    for (_, w), response in impulse_responses(fit, target, PORTS, duration, weights).items():
        length = 1 << int(np.ceil(np.log2(n + response.shape[1])))
        transfer = np.fft.rfft(response, length, axis=1)
        for motion in by_wheelset[w]:
            output = np.fft.irfft(transfer * np.fft.rfft(-motion, length), length, axis=1)
            rows.append(target.filter_and_weight(output[:, PULSE_DELAY : PULSE_DELAY + n]))
    return np.array(rows)
