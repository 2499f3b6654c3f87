"""Evaluator with a result cache: results in the cache are reused, all others computed and stored as they arrive."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.execution.cache import ResultCache, StoredResults, pack_responses
from railui.execution.tasks import ContentHashes, Runner, Task, TaskResult, is_design_failure
from railui.optimisation.cases import Case
from railui.optimisation.evaluation import ResponseTable


@dataclass
class EvaluationCount:
    """Simulations of this session: taken from the cache, computed, and the duration of the computation [s]."""

    cached: int = 0
    computed: int = 0
    seconds: float = 0.0


class CachedEvaluator:
    """Evaluator of a search from a cache and a runner; see `railui.optimisation.evaluation.Evaluator`."""

    def __init__(self, runner: Runner, cache: ResultCache) -> None:
        self.runner = runner
        self.cache = cache
        self.count = EvaluationCount()
        self._hashes = ContentHashes()

    def __call__(self, cases: Sequence[Case], rows: Sequence[FloatArray], keys: Collection[str]) -> ResponseTable:
        sorted_keys = tuple(sorted(keys))
        tasks = [
            Task(case, case_rows, sorted_keys, self._hashes.hash_rows(case, case_rows, sorted_keys))
            for case, case_rows in zip(cases, rows, strict=True)
        ]
        stored = self.cache.find({key for task in tasks for key in task.hashes})
        # earlier versions stored errors of the program as failures of designs
        results = {key: row for key, row in stored.items() if is_design_failure(row[2])}
        self.count.cached += len(results)
        results |= self._compute(_missing_tasks(tasks, results))
        return _response_table(tasks, results, sorted_keys)

    def _compute(self, tasks: Sequence[Task]) -> StoredResults:
        results: StoredResults = {}
        start, seconds_before = time.perf_counter(), self.count.seconds

        def store(result: TaskResult) -> None:
            packed = pack_responses(result.responses, result.task.hashes, result.task.keys)
            self.count.computed += len(packed)
            self.count.seconds = seconds_before + time.perf_counter() - start
            self.cache.put(packed, {"tally": [self.count.computed, self.count.seconds]})
            results.update(packed)

        if tasks:
            self.runner.run(tasks, store)
        return results


def _missing_tasks(tasks: Sequence[Task], results: StoredResults) -> list[Task]:
    """Return the tasks without the vehicles that have a result, each vehicle once."""
    missing, known = [], set(results)
    for task in tasks:
        first_index = {key: i for i, key in reversed(list(enumerate(task.hashes))) if key not in known}
        known |= first_index.keys()
        if indices := sorted(first_index.values()):
            hashes = tuple(task.hashes[i] for i in indices)
            missing.append(Task(task.case, task.rows[indices], task.keys, hashes))
    return missing


def _response_table(tasks: Sequence[Task], results: StoredResults, keys: Sequence[str]) -> ResponseTable:
    """Return the responses [design, case] of tasks, one task per case."""
    n = len(tasks[0])
    values = np.empty((n, len(tasks), len(keys)))
    distance_share = np.empty((n, len(tasks)))
    reasons = np.empty((n, len(tasks)), dtype=object)
    for j, task in enumerate(tasks):
        rows = [results[key] for key in task.hashes]
        values[:, j] = np.frombuffer(b"".join(row[0] for row in rows), "<f8").reshape(n, len(keys))
        distance_share[:, j] = [row[1] for row in rows]
        reasons[:, j] = [row[2] for row in rows]
    return ResponseTable({key: values[:, :, i] for i, key in enumerate(keys)}, distance_share, reasons)
