"""What runs on a worker of a cluster: what it computes with, and vehicles of some cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from distributed import get_worker

from railui.arrays import FloatArray
from railui.execution import tasks
from railui.execution.tasks import identity
from railui.optimisation.cases import Case
from railui.optimisation.responses import Responses

Parts = list[tuple[Responses, float]]


@dataclass(frozen=True)
class Refused:
    """What a worker answers whose digits would be others: where it is."""

    address: str


def identity_of_worker() -> Mapping[str, str]:
    """What a worker computes with."""
    return identity()


def run_bundle(
    expected: Mapping[str, str], parts: Sequence[tuple[FloatArray, tuple[str, ...]]], *cases: Case
) -> Parts | Refused | str:
    """Vehicles of some cases; Refused where this worker's digits would be others, a reason where nothing came of it.

    Nothing is raised: a client of distributed may lose an exception whose traceback is large.
    """
    if dict(expected) != identity():
        return Refused(get_worker().address)
    try:
        # rows that came over the wire may lie anywhere: the kernel wants them aligned
        return [tasks.run_task(case, np.array(rows), keys) for case, (rows, keys) in zip(cases, parts, strict=True)]
    except Exception as error:
        return f"{type(error).__name__}: {error}"


def differences(theirs: object) -> str:
    """In which parts the identity of a worker is another; what went wrong where it has none; "" where none."""
    if not isinstance(theirs, Mapping):
        return f"it has no railui that answers ({theirs})"
    mine = identity()
    names = {"kernel": "kernel sources", "python": "Python sources", "simd": "SIMD level"}
    differing = [name for name in mine if mine[name] != theirs.get(name)]
    return ", ".join(
        f"another {names[name]}" if name in ("kernel", "python")
        else f"{names.get(name, name)} {theirs.get(name)}, not {mine[name]}"
        for name in differing
    )  # fmt: skip
