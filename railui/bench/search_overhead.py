"""Overhead of a search over the kernel: search, cache and Python for generations of 256 designs x 4 cases x 1 km."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.bench.designs import BOGIE
from railui.core import resolve_thread_count
from railui.execution.session import Session
from railui.execution.threads import ThreadRunner
from railui.optimisation.cases import Case, cases_of
from railui.optimisation.design_space import DesignSpace, initial_population
from railui.optimisation.evaluation import ResponseTable
from railui.optimisation.multi_objective import search_pymoo
from railui.optimisation.objectives import assess
from railui.optimisation.responses import integrable_rows
from railui.optimisation.search import baseline_values
from railui.optimisation.study import Study
from railui.optimisation.study_reader import load_study
from railui.ride_quality.comfort import comfort_sections
from railui.ride_quality.statistics import BLOCK_DURATION, SCORE_CHANNELS

GENERATIONS: Final = 8
STUDY: Final = """\
name: overhead of a search
vehicle: vehicle.yaml
variables:
  vehicle.primary.lateral_stiffness: [1 MN/m, 8 MN/m]
  vehicle.primary.longitudinal_stiffness: [3 MN/m, 20 MN/m]
  vehicle.secondary.lateral_damping: [10 kN*s/m, 100 kN*s/m]
  vehicle.secondary.yaw_damping: [5 kN*m*s/rad, 200 kN*m*s/rad]
cases: {track: [erri_b176_low length=1000], speed: [40 m/s], seed: [1, 2, 3, 4], scenario: [{}]}
objectives: [{minimise: weighted_acceleration, over: mean}, {maximise: flange_margin, over: worst}]
method: {kind: nsga2, population: 256, generations: %d, seed: 1}
"""


class _Kernel:
    """Kernel time of the cases of an evaluator: one call per case, everything prepared."""

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs
        self.seconds = 0.0

    def time(self, cases: Sequence[Case], rows: Sequence[FloatArray]) -> None:
        """Add the time of the calls."""
        for case, all_rows in zip(cases, rows, strict=True):
            model, excitation = case.vehicle.model, case.excitation
            integrable, steps = integrable_rows(model, all_rows, excitation)
            designs = all_rows[integrable]
            sections = [np.ascontiguousarray(x) for x in comfort_sections(model, designs, excitation.dt).values()]
            vehicles, batch = model.vehicles(), model.batch(designs)
            clearance = np.ascontiguousarray(designs[:, model.columns["contact.flange_clearance"]])
            block = max(1, round(BLOCK_DURATION / excitation.dt))
            for n in np.unique(steps):
                members = np.flatnonzero(steps == n)
                inputs = (excitation.table(model.wheelset_distances(), int(n)), excitation.dt, int(n))
                group, weights = batch.select(members), [np.ascontiguousarray(x[members]) for x in sections]
                limits = clearance[members]
                start = time.perf_counter()
                vehicles.ride_statistics(group, *inputs, SCORE_CHANNELS, limits, weights, block=block, jobs=self.jobs)
                self.seconds += time.perf_counter() - start


def measure_search_overhead(jobs: int | None = None, generations: int = GENERATIONS) -> dict[str, Any]:
    """Measure the time of a whole search, of the bare kernel for the same rides, and their ratio.

    Both in turns, generation by generation, on the same threads, so that disturbances affect both alike.
    """
    threads = resolve_thread_count(jobs)
    with tempfile.TemporaryDirectory() as home:
        study = _study(Path(home), generations)
        with Session(study, Path(home) / "out", ThreadRunner(threads)) as session:
            requests: list[tuple[Sequence[Case], Sequence[FloatArray]]] = []

            def evaluator(cases: Sequence[Case], rows: Sequence[FloatArray], keys: Collection[str]) -> ResponseTable:
                requests.append((cases, rows))
                return session.evaluator(cases, rows, keys)

            cases, declared, kernel, whole = cases_of(study), baseline_values(study), _Kernel(threads), 0.0
            first = initial_population(
                DesignSpace(study.variables), study.method.population, declared, study.method.seed
            )
            steps = search_pymoo(study, first, lambda x: assess(study, cases, x, evaluator))
            next(steps)  # to warm up: tables, pymoo
            requests.clear()
            for _ in range(generations - 1):
                start = time.perf_counter()
                next(steps)
                whole += time.perf_counter() - start
                kernel.time(*requests.pop())
    return {
        "designs": study.method.population,
        "cases": len(cases),
        "generations": generations - 1,
        "seconds": whole,
        "kernel_seconds": kernel.seconds,
        "ratio": whole / kernel.seconds,
        "threads": threads,
    }


def _study(home: Path, generations: int) -> Study:
    (home / "vehicle.yaml").write_text(BOGIE, "utf-8")
    (home / "study.yaml").write_text(STUDY % generations, "utf-8")
    return load_study(home / "study.yaml")
