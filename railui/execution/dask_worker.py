"""Functions that run on a worker of a dask cluster: its identity, and the evaluation of task bundles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from distributed import get_worker
from distributed.protocol.pickle import dumps, loads

from railui.arrays import FloatArray
from railui.execution import tasks
from railui.execution.tasks import environment_identity
from railui.optimisation.cases import Case
from railui.optimisation.responses import Responses

Item = TypeVar("Item")
BundleResults = list[tuple[Responses, float]]


@dataclass(frozen=True)
class MismatchedWorker:
    """Worker that would not reproduce results bit for bit."""

    address: str


@dataclass(frozen=True)
class FailedBundle:
    """Bundle whose evaluation failed by an error of the program or the machine."""

    reason: str


class PackedCase:
    """Case as bytes, unpacked once by each worker that has it.

    dask takes the arrays out of an object that it transfers, and they arrive at any address. numpy sums them in other
    blocks there, which changes the last digits. Bytes are transferred as they are.
    """

    def __init__(self, data: bytes) -> None:
        self.data = data

    @classmethod
    def of(cls, case: Case) -> PackedCase:
        """Pack a case."""
        return cls(dumps(case))

    @cached_property
    def case(self) -> Case:
        """The case."""
        case: Case = loads(self.data)
        return case

    def __reduce__(self) -> tuple[type[PackedCase], tuple[bytes]]:
        return PackedCase, (self.data,)


def worker_identity() -> Mapping[str, str]:
    """Return the environment of a worker."""
    return environment_identity()


def run_bundle(
    expected: Mapping[str, str], parts: Sequence[tuple[FloatArray, tuple[str, ...]]], *cases: PackedCase
) -> BundleResults | MismatchedWorker | FailedBundle:
    """Run the tasks of a bundle: rows [n, row] and keys, for every case.

    Returns a MismatchedWorker if this worker's environment differs from `expected`, a FailedBundle if the
    evaluation fails by an error that is not of a design.
    Nothing is raised: a client of distributed may lose an exception whose traceback is large.
    """
    if dict(expected) != environment_identity():
        return MismatchedWorker(get_worker().address)
    try:
        # received rows may begin at any address
        return [tasks.run_task(c.case, np.array(rows), keys) for c, (rows, keys) in zip(cases, parts, strict=True)]
    except tasks.EvaluationError as error:
        return FailedBundle(str(error))
    except Exception as error:
        return FailedBundle(f"{type(error).__name__}: {error}")


def pack_call(function: Callable[[Item], Any], item: Item) -> bytes:
    """Return a call as bytes, in which arrays keep their alignment, see `PackedCase`."""
    return bytes(dumps((function, item)))


def run_checked(expected: Mapping[str, str], call: bytes) -> bytes | MismatchedWorker:
    """Return the packed result of a packed call; a MismatchedWorker if this environment differs from `expected`."""
    if dict(expected) != environment_identity():
        return MismatchedWorker(get_worker().address)
    function, item = loads(call)
    return bytes(dumps(function(item)))


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
