"""Designs on all cases of a study: who evaluates them, and their numbers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import jobs_or_all
from railui.optimisation.cases import Case
from railui.optimisation.responses import Responses, evaluate_case


@dataclass(frozen=True, eq=False)
class ResponseTable:
    """Keys of the results -> values [design, case]; travelled [design, case]: the share of the way, 1 all of it.

    reasons [design, case]: why a design failed in a case, empty where it did not.
    """

    values: Mapping[str, FloatArray]
    travelled: FloatArray
    reasons: NDArray[np.object_]

    @classmethod
    def stacked(cls, found: Sequence[Responses], keys: Collection[str]) -> ResponseTable:
        """The answers of all cases, one after the other."""
        values = {key: np.stack([one.values[key] for one in found], axis=1) for key in keys}
        reasons = np.empty((len(found[0].reasons), len(found)), dtype=object)
        for j, one in enumerate(found):
            reasons[:, j] = one.reasons
        return cls(values, np.stack([one.travelled for one in found], axis=1), reasons)

    def of_cases(self, some: slice) -> ResponseTable:
        """The numbers in some of the cases."""
        values = {key: each[:, some] for key, each in self.values.items()}
        return ResponseTable(values, self.travelled[:, some], self.reasons[:, some])

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which designs failed in any case: [design]."""
        return np.asarray(np.any(self.travelled < 1, axis=1))


# the keys of vehicles, rows [n, row] for each case: in this process, from a store, on a cluster
Evaluator = Callable[[Sequence[Case], Sequence[FloatArray], Collection[str]], ResponseTable]


def evaluate_in_process(jobs: int | None = None) -> Evaluator:
    """An evaluator that asks the kernel, case by case, groups of lanes on so many threads."""

    def evaluate(cases: Sequence[Case], rows: Sequence[FloatArray], keys: Collection[str]) -> ResponseTable:
        known: dict[tuple[int, int], Responses] = {}
        for case, some in zip(cases, rows, strict=True):
            if (same := (id(case.road), id(some))) not in known:
                known[same] = evaluate_case(case, some, keys, jobs_or_all(jobs))
        return ResponseTable.stacked(
            [known[id(case.road), id(some)] for case, some in zip(cases, rows, strict=True)], keys
        )

    return evaluate


def rows_of(cases: Sequence[Case], x: FloatArray) -> list[FloatArray]:
    """Rows [n, row] of designs with values x [n, variable], for each case; the same array where the vehicle is."""
    made: dict[int, FloatArray] = {}
    for case in cases:
        if id(case.vehicle) not in made:
            made[id(case.vehicle)] = case.vehicle.rows(x)
    return [made[id(case.vehicle)] for case in cases]


def response_table(
    cases: Sequence[Case], x: FloatArray, keys: Collection[str], evaluator: Evaluator | None = None
) -> ResponseTable:
    """The keys of designs with values x [design, variable] on all cases."""
    return (evaluator or evaluate_in_process())(cases, rows_of(cases, x), keys)
