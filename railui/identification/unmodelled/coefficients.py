"""The sixteen coefficients of y_i, y_i', psi_i, psi_i' in the wheelset equations, freed beside the parameters.

Together with the wheel-rail parameters they are the most that measured motions can determine (thesis 3.4, table 3.1).
One that contradicts its derivation points to the equation in which something is missing. A coefficient that is off by
delta acts like a force -delta times the motion on the wheelset: its sensitivity is the answer to that force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.dataset import simulate
from railui.identification.estimation.block_products import block_gram, scaled_inverse
from railui.identification.estimation.output_error import Fit, GaussNewton
from railui.identification.estimation.problem import FitSegment
from railui.identification.structure.equivalent_inputs import DELAY, pulses
from railui.identification.structure.projection import VANISHED

MEMORY = 6.0  # s after which a pulse has died away
PORTS = tuple((at, w) for w in (1, 2) for at in ("wheelset", "wheelset_yaw"))
TERMS = ("y", "y'", "psi", "psi'")
CONTRADICTS = 4.0  # standard deviations from its derivation
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
    """One coefficient: its equation (lateral or yaw, of a wheelset), the motion, how far it is from its derivation.

    difference, sd in `unit`; t: the ratio; share: of the squared residual that freeing it alone explains.
    """

    wheelset: int
    equation: str
    motion: str
    difference: float
    sd: float
    unit: str
    share: float

    @property
    def t(self) -> float:
        """Standard deviations from its derivation."""
        return self.difference / self.sd if self.sd > 0 else 0.0

    @property
    def contradicts(self) -> bool:
        """Is it so far from its derivation that something is missing in its equation?"""
        return abs(self.t) > CONTRADICTS


def coefficients(fit: Fit) -> list[Coefficient]:
    """All sixteen, each freed alone beside the adjusted parameters: first order, at the mean speed of each stretch.

    Raises ValueError for a vehicle that has no wheelsets.
    """
    if fit.model.design.kind != "bogie":
        raise ValueError("a rig has no wheelset equations: leave --coefficients out")
    adjuster = GaussNewton(fit.model, fit.free, fit.segments, block=fit.block, stable=False, jobs=1)
    grams = []
    for target in fit.segments:
        base, _ = adjuster.sensitivities(target, fit.x)
        rows = np.concatenate([base, target.without_initial_state(_answers(fit, target))])
        grams.append(block_gram(rows, fit.block_samples(target)).sum(axis=1))
    gram = np.concatenate(grams)
    own = 1 + len(fit.x)
    prior = np.diag(fit.normal.variance / fit.free.prior_sd**2)
    names = [(w, at, term) for at, w in PORTS for term in TERMS]
    total = gram.sum(axis=0)
    projector = scaled_inverse(total[1:own, 1:own] + prior, 1e-10)
    out = []
    for k, (wheelset, at, term) in enumerate(names):
        i = own + k
        absorbed = projector @ total[1:own, i]
        left = total[i, i] - total[i, 1:own] @ absorbed
        scores = gram[:, 0, i] - gram[:, 0, 1:own] @ absorbed
        if left <= VANISHED * total[i, i]:
            continue  # a parameter does the same
        difference = float(scores.sum() / left)
        sd = float(np.sqrt(np.sum((scores - scores.mean()) ** 2)) / left)
        share = float(scores.sum() ** 2 / left / fit.normal.rss)
        equation = "yaw" if at.endswith("yaw") else "lateral"
        out.append(Coefficient(wheelset, equation, term, difference, sd, UNITS[(at, term)], share))
    return sorted(out, key=lambda c: -c.share)


def _answers(fit: Fit, target: FitSegment) -> FloatArray:
    """Weighted output per unit of each coefficient [16, channel, n]: the answer to minus the motion as a force."""
    stretch, model = target.segment, fit.model
    motions = [f"{q}.{at}.{w}" for w in (1, 2) for at in ("wheelset", "wheelset_yaw") for q in ("z", "v")]
    series, _ = simulate(model, stretch, motions, steps=target.steps, initial=target.initial_state)
    by_wheelset: dict[int | None, FloatArray] = {1: series[0][:4], 2: series[0][4:]}  # y, y', psi, psi'
    rows, n = [], stretch.samples
    for (_, w), answer in pulses(fit, target, PORTS, MEMORY, np.ones(len(stretch.channels))).items():
        length = 1 << int(np.ceil(np.log2(n + answer.shape[1])))
        transfer = np.fft.rfft(answer, length, axis=1)
        for motion in by_wheelset[w]:
            moved = np.fft.irfft(transfer * np.fft.rfft(-motion, length), length, axis=1)[:, DELAY : DELAY + n]
            rows.append(target.filter_and_weight(moved))
    return np.array(rows)
