"""Evaluation of designs on all cases of a study."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import resolve_thread_count
from railui.optimisation.cases import Case
from railui.optimisation.responses import Responses, evaluate_case


@dataclass(frozen=True, eq=False)
class ResponseTable:
    """Responses of designs on all cases.

    Attributes
    ----------
    values : mapping of str to float [design, case]
        Values by key.
    distance_share : float [design, case]
        Completed share of the track; 1 unless the design failed in the case.
    reasons : object [design, case]
        Reason of failure; empty where the design did not fail.
    """

    values: Mapping[str, FloatArray]
    distance_share: FloatArray
    reasons: NDArray[np.object_]

    @classmethod
    def from_cases(cls, responses: Sequence[Responses], keys: Collection[str]) -> ResponseTable:
        """Collect the responses of all cases, one item per case."""
        values = {key: np.stack([case.values[key] for case in responses], axis=1) for key in keys}
        reasons = np.empty((len(responses[0].reasons), len(responses)), dtype=object)
        for j, case in enumerate(responses):
            reasons[:, j] = case.reasons
        return cls(values, np.stack([case.distance_share for case in responses], axis=1), reasons)

    def select_cases(self, cases: slice) -> ResponseTable:
        """Return the table of some of the cases."""
        values = {key: column[:, cases] for key, column in self.values.items()}
        return ResponseTable(values, self.distance_share[:, cases], self.reasons[:, cases])

    @property
    def failed(self) -> NDArray[np.bool_]:
        """True for a design that failed in any case [design]."""
        return np.asarray(np.any(self.distance_share < 1, axis=1))


# responses to keys of vehicles, kernel rows [n, row] for each case: in this process, from a cache or on a cluster
Evaluator = Callable[[Sequence[Case], Sequence[FloatArray], Collection[str]], ResponseTable]


def evaluate_in_process(jobs: int | None = None) -> Evaluator:
    """Return an evaluator that calls the kernel case by case, with so many threads (all by default)."""

    def evaluate(cases: Sequence[Case], rows: Sequence[FloatArray], keys: Collection[str]) -> ResponseTable:
        known: dict[tuple[int, int], Responses] = {}
        identities = [(id(case.excitation), id(case_rows)) for case, case_rows in zip(cases, rows, strict=True)]
        for identity, case, case_rows in zip(identities, cases, rows, strict=True):
            if identity not in known:
                known[identity] = evaluate_case(case, case_rows, keys, resolve_thread_count(jobs))
        return ResponseTable.from_cases([known[identity] for identity in identities], keys)

    return evaluate


def kernel_rows(cases: Sequence[Case], x: FloatArray) -> list[FloatArray]:
    """Return the rows [n, row] of designs x [n, variable] for each case; cases of one vehicle share one array."""
    known: dict[int, FloatArray] = {}
    for case in cases:
        if id(case.vehicle) not in known:
            known[id(case.vehicle)] = case.vehicle.rows(x)
    return [known[id(case.vehicle)] for case in cases]


def response_table(
    cases: Sequence[Case], x: FloatArray, keys: Collection[str], evaluator: Evaluator | None = None
) -> ResponseTable:
    """Evaluate keys of designs x [design, variable] on all cases, in this process by default."""
    return (evaluator or evaluate_in_process())(cases, kernel_rows(cases, x), keys)
