"""Equation-error estimates of a rig with a nonlinear law: linear least squares, without local minima.

The equation of motion by modulating functions (Shinbrot 1957, see modulating_functions.py) has one term more: a
strength times the force of the law at the measured motion. The output error of a strongly driven nonlinear rig has
minima far from the true one, near the linear model that fits best; the equation error of a law that is linear in its
strength has one minimum. Noise of the motion biases it (errors in variables), so that it gives start values only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.dsp.integrate import integrate
from railui.identification.component_force import restoring_force
from railui.identification.estimation.modulating_functions import (
    DERIVATIVES,
    MIN_SHARE,
    TERMS,
    dominant_period,
    window_equations,
)
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

WINDOW_PERIODS = 1.5  # of the dominant motion: longer windows average away the harmonics that distinguish laws
CORNER_PERIODS = 10.0  # period of the high-pass of integrated channels, in the dominant period
DAMPING_RATIO = 0.7071  # of that high-pass
SETTLING_SHARE = 0.75  # of its period, by which the ends of an integrated channel are wrong
FORCE = len(TERMS) + 1  # column of the force in the equations


class LawEstimate(NamedTuple):
    """Estimates of a rig with a law.

    Attributes
    ----------
    values
        Of the free parameters [p].
    amount
        Strength over that of the law as it was given.
    share
        Squared equation error over that without the law.
    """

    values: FloatArray
    amount: float
    share: float


class EquationError:
    """Equations of motion of a rig in windows of its records, to which the force of a law can be added.

    Parameters
    ----------
    model
        Its effects act with their parameters as they are.
    segments
        Whole segments.
    free
        Paths of the parameters to estimate; the others have the values of the model.
    """

    def __init__(self, model: Model, segments: Sequence[Segment], free: Sequence[str]) -> None:
        self.model = model
        self.free = free
        self.values = {name: model.value(f"vehicle.rig.{name}") for name in TERMS}
        self.names = [n for n in TERMS if f"vehicle.rig.{n}" in free]
        replaces_terms = any(core.effect_record(e.kind)["supersedes"] for e in model.design.effects)
        is_possible = not replaces_terms and not {"mass", "gain"} <= set(self.names)
        self.motions = [(s, z) for s in segments if (z := self._stretch(s)) is not None] if is_possible else []
        self.table = self._equations(model.design.effects)
        self.rss = self._solve()[1] if self.is_determined else 0.0

    @property
    def is_determined(self) -> bool:
        """True where there are clearly more equations than unknowns."""
        return len(self.table) > 2 * (len(TERMS) + 2)

    def estimate(self, effect: PlacedEffect) -> LawEstimate | None:
        """Estimate the free parameters and the strength of a law; None where its force cannot be computed or is 0."""
        try:
            force = self._equations([effect])[:, FORCE]
        except ValueError:  # too stiff to be integrated
            return None
        if not self.is_determined or not np.any(force):
            return None
        terms, rss, amount = self._solve(force)
        values = [terms.get(p.rpartition(".")[2], self.model.value(p)) for p in self.free]
        return LawEstimate(np.array(values), amount, rss / max(self.rss, 1e-300))

    def _stretch(self, segment: Segment) -> FloatArray | None:
        """Deformation [n] of the spring, its mean removed; None where it is not measured."""
        channel = next((c for c in DERIVATIVES if c in segment.columns), None)
        u = segment.columns.get("u")
        on_base = u is not None and self.model.design.rig_input == "base_displacement"
        if channel is None or (on_base and channel != "z"):
            return None
        y = segment.columns[channel]
        if on_base and u is not None:
            y = y - self.values["gain"] * u
        if channel != "z":
            y = integrate(y, segment.dt, DERIVATIVES[channel], _corner(segment), DAMPING_RATIO)
        return np.asarray(y - y.mean())

    def _equations(self, effects: Sequence[PlacedEffect]) -> FloatArray:
        """Equations of all windows with the force of some effects."""
        rows = [np.zeros((0, FORCE + 2))]
        for segment, z in self.motions:
            force = restoring_force(z, segment.dt, effects, 0.0, 0.0)[0] if effects else np.zeros_like(z)
            margin = 0 if "z" in segment.columns else round(SETTLING_SHARE / (_corner(segment) * segment.dt))
            rig_input = self.model.design.rig_input
            rows.append(
                window_equations(segment, rig_input, self.values, [force], periods=WINDOW_PERIODS, margin=margin)
            )
        return np.vstack(rows)

    def _solve(self, force: FloatArray | None = None) -> tuple[dict[str, float], float, float]:
        """Solve the equations for the free terms, a constant and the amount of a force [window].

        Returns the terms by name, the squared equation error, and the amount.
        """
        columns = [TERMS.index(n) for n in self.names if np.any(self.table[:, TERMS.index(n)])]
        known = [j for j in range(len(TERMS)) if j not in columns]
        right = -self.table[:, known] @ np.array([self.values[TERMS[j]] for j in known]) - self.table[:, FORCE]
        a = self.table[:, [*columns, len(TERMS)]]
        a = a if force is None else np.column_stack([a, force])
        size = np.maximum(np.linalg.norm(a, axis=0), 1e-300)
        solution = np.linalg.lstsq(a / size, right, rcond=None)[0] / size
        terms = dict(zip((TERMS[j] for j in columns), solution.tolist(), strict=False))
        positive = {n: x if n == "gain" or x > 0 else MIN_SHARE * abs(self.values[n]) for n, x in terms.items()}
        return positive, float(np.sum((a @ solution - right) ** 2)), 0.0 if force is None else float(solution[-1])


def _corner(segment: Segment) -> float:
    """Natural frequency [Hz] of the high-pass of integrated channels."""
    return 1.0 / (CORNER_PERIODS * dominant_period(segment))
