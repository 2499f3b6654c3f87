"""The evaluator of a search: what the store knows is answered from it, the rest is done and kept as it arrives."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.execution.cache import Known, Store, packed
from railui.execution.tasks import Hashes, Runner, Task, TaskResult
from railui.optimisation.cases import Case
from railui.optimisation.evaluation import ResponseTable


@dataclass
class Tally:
    """Rides of this session: known from the store, done now, and the seconds that doing took."""

    known: int = 0
    done: int = 0
    seconds: float = 0.0


class StoredEvaluator:
    """Answers a search from a store and a runner; see `railui.optimisation.evaluation.Evaluator`."""

    def __init__(self, runner: Runner, store: Store) -> None:
        self.runner, self.store = runner, store
        self.tally = Tally()
        self._hashes = Hashes()

    def __call__(self, cases: Sequence[Case], rows: Sequence[FloatArray], keys: Collection[str]) -> ResponseTable:
        asked = tuple(sorted(keys))
        whole = [Task(c, some, asked, self._hashes.of(c, some, asked)) for c, some in zip(cases, rows, strict=True)]
        known = self.store.known({key for work in whole for key in work.hashes})
        self.tally.known += len(known)
        known |= self._do(_unknown(whole, known))
        return _numbers(whole, known, asked)

    def _do(self, works: Sequence[Task]) -> Known:
        found: Known = {}
        begun, before = time.perf_counter(), self.tally.seconds

        def keep(done: TaskResult) -> None:
            some = packed(done.answered, done.work.hashes, done.work.keys)
            self.tally.done += len(some)
            self.tally.seconds = before + time.perf_counter() - begun
            self.store.put(some, {"tally": [self.tally.done, self.tally.seconds]})
            found.update(some)

        if works:
            self.runner.run(works, keep)
        return found


def _unknown(whole: Sequence[Task], known: Known) -> list[Task]:
    """The works without what is known, each vehicle once."""
    found, seen = [], set(known)
    for work in whole:
        first = {key: i for i, key in reversed(list(enumerate(work.hashes))) if key not in seen}
        seen |= first.keys()
        if new := sorted(first.values()):
            found.append(Task(work.case, work.rows[new], work.keys, tuple(work.hashes[i] for i in new)))
    return found


def _numbers(whole: Sequence[Task], known: Known, keys: Sequence[str]) -> ResponseTable:
    """Numbers [design, case] from what is known."""
    n = len(whole[0])
    values = np.empty((n, len(whole), len(keys)))
    travelled, reasons = np.empty((n, len(whole))), np.empty((n, len(whole)), dtype=object)
    for j, work in enumerate(whole):
        rows = [known[key] for key in work.hashes]
        values[:, j] = np.frombuffer(b"".join(row[0] for row in rows), "<f8").reshape(n, len(keys))
        travelled[:, j] = [row[1] for row in rows]
        reasons[:, j] = [row[2] for row in rows]
    return ResponseTable({key: values[:, :, i] for i, key in enumerate(keys)}, travelled, reasons)
