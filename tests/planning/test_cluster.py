"""Information of runs on a real scheduler: the digits of one process, also where a worker is killed."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("distributed")

from railui.execution.dask_cluster import DaskRunner
from railui.planning.information import Information, collect_information
from railui.planning.store import ARRAYS
from tests.execution.cluster import LocalCluster
from tests.planning.test_information import context, information


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[LocalCluster]:
    machines = LocalCluster(tmp_path)
    yield machines
    machines.stop()


def is_same(a: Information, b: Information) -> bool:
    """Return whether all arrays agree to the last bit."""
    pairs = [(getattr(x, name), getattr(y, name)) for x, y in zip(a.runs, b.runs, strict=True) for name in ARRAYS]
    return a.keys == b.keys and all(np.array_equal(x, y) for x, y in pairs)


@pytest.mark.slow
def test_a_cluster_computes_the_digits_of_one_process(cluster: LocalCluster) -> None:
    doomed, _ = cluster.start_workers(2)
    runner = DaskRunner(cluster.address)
    timer = threading.Timer(1.0, doomed.kill)
    timer.start()
    try:
        found = collect_information(context(), cluster=runner)
    finally:
        timer.cancel()
        runner.close()
    assert doomed.poll() is not None, "the worker was not killed while it computed"
    assert is_same(found, information())
