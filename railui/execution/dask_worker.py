"""Functions that run on a worker of a dask cluster: its identity, and the evaluation of task bundles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from distributed import get_worker

from railui.arrays import FloatArray
from railui.execution import tasks
from railui.execution.tasks import environment_identity
from railui.optimisation.cases import Case
from railui.optimisation.responses import Responses

Item = TypeVar("Item")
Result = TypeVar("Result")
BundleResults = list[tuple[Responses, float]]


@dataclass(frozen=True)
class MismatchedWorker:
    """Worker that would not reproduce results bit for bit."""

    address: str


def worker_identity() -> Mapping[str, str]:
    """Return the environment of a worker."""
    return environment_identity()


def run_bundle(
    expected: Mapping[str, str], parts: Sequence[tuple[FloatArray, tuple[str, ...]]], *cases: Case
) -> BundleResults | MismatchedWorker | str:
    """Run the tasks of a bundle: rows [n, row] and keys, for every case.

    Returns a MismatchedWorker if this worker's environment differs from `expected`, a reason if the evaluation fails.
    Nothing is raised: a client of distributed may lose an exception whose traceback is large.
    """
    if dict(expected) != environment_identity():
        return MismatchedWorker(get_worker().address)
    try:
        # received rows may have any alignment, but the kernel needs aligned ones
        return [tasks.run_task(case, np.array(rows), keys) for case, (rows, keys) in zip(cases, parts, strict=True)]
    except Exception as error:
        return f"{type(error).__name__}: {error}"


def run_checked(
    expected: Mapping[str, str], function: Callable[[Item], Result], item: Item
) -> Result | MismatchedWorker:
    """Return a function of an item; a MismatchedWorker if this worker's environment differs from `expected`."""
    if dict(expected) != environment_identity():
        return MismatchedWorker(get_worker().address)
    return function(item)


def identity_differences(worker: object) -> str:
    """Describe how the identity of a worker differs from that of this process; "" if it does not.

    `worker` is the identity, or the exception that the worker raised.
    """
    if not isinstance(worker, Mapping):
        return f"it has no railui that responds ({worker})"
    expected = environment_identity()
    sources = {"kernel": "other kernel sources", "python": "other Python sources"}
    differences = []
    for name, value in expected.items():
        if value != worker.get(name):
            label = "SIMD level" if name == "simd" else name
            differences.append(sources.get(name, f"{label} {worker.get(name)}, not {value}"))
    return ", ".join(differences)
