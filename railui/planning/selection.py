"""Greedy selection of sensors and runs under a budget, by what they detect and determine per cost."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from railui.identification.structure.candidates import Candidate
from railui.planning.expectation import Choice, Expectation

LEAST_SHARE = 0.01  # of the best attainable precision, to which what is not detected at all counts


@dataclass(frozen=True)
class Reference:
    """Least amounts and standard deviations with every sensor and every run, which a choice is compared with."""

    amounts: Mapping[Candidate, float]
    parameter_sd: tuple[float, ...]


@dataclass(frozen=True)
class Step:
    """A step of the selection: what it added, the choice afterwards, its cost and its attained share."""

    added: str
    choice: Choice
    cost: float
    share: float


def reference(everything: Expectation) -> Reference:
    """Return what everything together detects and determines."""
    least = {c: a for c, a in everything.least_amounts().items() if np.isfinite(a)}
    return Reference(least, tuple(everything.parameter_sd.tolist()))


def attained_share(expected: Expectation, best: Reference) -> float:
    """Return the geometric mean share of the best attainable precision, over effects and parameters alike.

    1: every effect is detected at the size, and every parameter determined to the standard deviation, that all sensors
    and runs together allow.
    """
    least = expected.least_amounts()
    effects = [np.log(max(amount / least[c], LEAST_SHARE)) for c, amount in best.amounts.items()]
    ratios = np.array(best.parameter_sd) / np.maximum(expected.parameter_sd, 1e-300)
    parameters = np.log(np.clip(ratios, LEAST_SHARE, 1.0))
    return float(np.exp(0.5 * (np.mean(effects) + np.mean(parameters)))) if effects else 0.0


class Selection:
    """Search of the best sensors and runs.

    Parameters
    ----------
    sensors, runs
        Names of the sensors, and numbers of the runs that may be made.
    costs
        Cost by sensor; cost_of_run: that of a run.
    expect
        Expectation of a choice.
    best
        What all of them attain.
    """

    def __init__(
        self,
        sensors: Sequence[str],
        runs: Mapping[int, str],
        costs: Mapping[str, float],
        cost_of_run: float,
        expect: Callable[[Choice], Expectation],
        best: Reference,
    ) -> None:
        self.sensors, self.runs = sensors, runs
        self.costs, self.cost_of_run = costs, cost_of_run
        self.expect, self.best = expect, best

    def cost(self, choice: Choice) -> float:
        """Sum of the costs of a choice."""
        runs = len(choice.estimation) + 1
        return sum(self.costs[c] for c in choice.channels) + runs * self.cost_of_run

    def steps(self, budget: float | None) -> list[Step]:
        """Add sensors and runs, the best per cost first, while the budget lasts and something is gained.

        The selection starts with the best pair of an estimation and a validation run for a single sensor. It returns no
        step where the budget does not allow for them.
        """
        found: list[Step] = []
        current = self._first(budget)
        while current is not None:
            found.append(current)
            current = self._next(current, budget)
        return found

    def _first(self, budget: float | None) -> Step | None:
        tried = [
            self._step(f"{channel}; {self.runs[a]} for estimation, {self.runs[b]} for validation", choice)
            for channel in self.sensors
            for a, b in permutations(self.runs, 2)
            if self._is_affordable(choice := Choice((channel,), (a,), b), budget)
        ]
        return max(tried, key=lambda s: s.share / max(s.cost, 1e-9), default=None)

    def _next(self, current: Step, budget: float | None) -> Step | None:
        tried = [
            self._step(added, choice)
            for added, choice in self._additions(current.choice)
            if self._is_affordable(choice, budget)
        ]
        gains = [s for s in tried if s.share > current.share]
        return max(
            gains, key=lambda s: np.log(s.share / current.share) / max(s.cost - current.cost, 1e-9), default=None
        )

    def _additions(self, choice: Choice) -> Iterator[tuple[str, Choice]]:
        for c in self.sensors:
            if c not in choice.channels:
                chosen = tuple(x for x in self.sensors if x in {*choice.channels, c})
                yield c, Choice(chosen, choice.estimation, choice.validation)
        for i, name in self.runs.items():
            if i not in (*choice.estimation, choice.validation):
                yield name, Choice(choice.channels, (*choice.estimation, i), choice.validation)

    def _step(self, added: str, choice: Choice) -> Step:
        return Step(added, choice, self.cost(choice), attained_share(self.expect(choice), self.best))

    def _is_affordable(self, choice: Choice, budget: float | None) -> bool:
        return budget is None or self.cost(choice) <= budget + 1e-9
