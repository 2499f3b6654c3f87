"""A study on a real scheduler: killed workers and scheduler, refused workers, a case that kills its worker."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from pathlib import Path

import pytest

pytest.importorskip("distributed")

from tests.execution.cluster import LocalCluster
from tests.execution.small import railui, result, run, write_study
from tests.execution.test_resume import count_stored, wait_for_results


def start_on_cluster(study: Path, out: Path, cluster: LocalCluster) -> subprocess.Popen[str]:
    return subprocess.Popen(
        railui("optimise", study, "-o", out, "--scheduler", cluster.address, "-v"),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_with_a_killed_worker_the_result_is_that_of_one_machine(tmp_path: Path, cluster: LocalCluster) -> None:
    study = write_study(tmp_path, length=1000, population=32, generations=8)
    worker = cluster.start_workers(2)[0]
    process = start_on_cluster(study, tmp_path / "many", cluster)
    wait_for_results(tmp_path / "many", 1, process)
    worker.kill()
    messages = process.communicate(timeout=200)[1]
    assert process.returncode == 0, messages
    assert run("optimise", study, "-o", tmp_path / "one").returncode == 0
    assert result(tmp_path / "many") == result(tmp_path / "one")


def test_results_survive_a_killed_scheduler_and_the_search_can_resume(tmp_path: Path, cluster: LocalCluster) -> None:
    study = write_study(tmp_path, length=2000, population=64, generations=20)
    cluster.start_workers(2)
    process = start_on_cluster(study, tmp_path / "out", cluster)
    wait_for_results(tmp_path / "out", 1, process)
    cluster.scheduler.send_signal(signal.SIGKILL)
    messages = process.communicate(timeout=120)[1]
    assert process.returncode == 3 and "is lost" in messages and "the same command resumes" in messages
    assert count_stored(tmp_path / "out") > 0
    status = json.loads(run("status", tmp_path / "out", "--json", "-").stdout)
    assert status["state"] == "interrupted"
    again = run("optimise", study, "-o", tmp_path / "out", "--scheduler", cluster.address)
    assert again.returncode == 3 and "no scheduler answers" in again.stderr


@pytest.mark.slow
def test_a_worker_with_another_simd_level_or_version_is_refused(tmp_path: Path, cluster: LocalCluster) -> None:
    newer = tmp_path / "newer.py"
    newer.write_text("import railui\nrailui.__version__ = '9.9'\n", "utf-8")
    cluster.start_worker(RAILUI_SIMD="portable")
    cluster.start_worker("--preload", str(newer))
    cluster.start_worker()
    study = write_study(tmp_path, population=8, generations=2)
    time.sleep(4)  # until all three have joined
    process = start_on_cluster(study, tmp_path / "many", cluster)
    messages = process.communicate(timeout=120)[1]
    assert process.returncode == 0, messages
    # a worker that leaves for a moment is refused again
    refused = {line for line in messages.splitlines() if "refused" in line}
    assert "SIMD level portable, not" in messages and "railui 9.9, not" in messages and len(refused) == 2
    assert run("optimise", study, "-o", tmp_path / "one").returncode == 0
    assert result(tmp_path / "many") == result(tmp_path / "one")


# a preload may be imported twice: `original` stays the function of railui
KILLING_PRELOAD = """\
import os, signal
from railui.execution import tasks

original = getattr(tasks, "original_run_task", tasks.run_task)
tasks.original_run_task = original

def run_task(case, rows, keys):
    damping = rows[:, case.vehicle.model.columns["vehicle.secondary.yaw_damping"]]
    if case.excitation.source.seed == 1 and any((10000 < damping) & (damping < 15000)):
        os.kill(os.getpid(), signal.SIGKILL)
    return original(case, rows, keys)

tasks.run_task = run_task
"""


@pytest.mark.slow
def test_only_the_case_that_kills_its_worker_fails(tmp_path: Path, cluster: LocalCluster) -> None:
    preload = tmp_path / "killing.py"
    preload.write_text(KILLING_PRELOAD, "utf-8")
    for _ in range(2):
        cluster.start_worker("--preload", str(preload), nanny=True)
    study = write_study(tmp_path, length=200, population=16, generations=1)
    process = start_on_cluster(study, tmp_path / "out", cluster)
    messages = process.communicate(timeout=250)[1]
    assert process.returncode == 0, messages
    document = result(tmp_path / "out")
    assert 0 < document["failures"]["killed its worker"] == document["failed"] < 8
    assert document["pareto"]
