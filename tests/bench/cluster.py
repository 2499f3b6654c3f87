"""Scaling of a cluster on loopback: overhead of a task over its rides.

python -m tests.bench.cluster: a scheduler and two workers; many pieces of one short ride.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from railui.execution.dask_cluster import BundleRun, DaskRunner
from railui.execution.task_bundles import BUNDLE_SECONDS, TaskBundle
from railui.execution.tasks import ContentHashes, Task, TaskResult
from railui.optimisation.cases import cases_of
from railui.optimisation.evaluation import kernel_rows
from railui.optimisation.study_reader import load_study
from tests.execution.cluster import LocalCluster
from tests.execution.small import write_study

PIECES = 1000


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        machines = LocalCluster(home)
        machines.start_workers(2)
        cluster = DaskRunner(machines.address)
        while cluster.workers < 2:
            cluster.update_workers()
            time.sleep(0.2)
        study = load_study(write_study(home, length=50))
        case = cases_of(study)[0]
        x = np.array([[v.lowest for v in study.variables]]) * np.linspace(1, 2, PIECES)[:, None]
        rows = kernel_rows([case], x)[0]
        whole = Task(case, rows, ("score",), ContentHashes().hash_rows(case, rows, ("score",)))
        done: list[TaskResult] = []
        BundleRun(cluster, done.append).run([TaskBundle([whole.select(slice(0, 1))])])
        start = time.perf_counter()
        BundleRun(cluster, done.append).run(TaskBundle([whole.select(slice(i, i + 1))]) for i in range(PIECES))
        seconds = time.perf_counter() - start
        rides = sum(one.seconds for one in done[1:]) / 2
        each = (seconds - rides) / PIECES
        print(f"{PIECES} pieces in {seconds:.2f} s, {rides:.2f} s of it rides: {1e3 * each:.2f} ms a piece")
        workers = BUNDLE_SECONDS / each
        print(f"a scheduler and its client keep {workers:.0f} workers busy with bundles of {BUNDLE_SECONDS:g} s")
        cluster.close()
        machines.stop()


if __name__ == "__main__":
    main()
