"""The same study on a real scheduler: workers and the scheduler killed, strangers refused, a poisonous case alone."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("distributed")

from tests.execution.cluster import Machines
from tests.execution.small import railui, result, run, write_study
from tests.execution.test_resume import await_results, stored


@pytest.fixture
def machines(tmp_path: Path) -> Iterator[Machines]:
    home = tmp_path / "machines"
    home.mkdir()
    found = Machines(home)
    yield found
    found.stop()


def spread(study: Path, out: Path, machines: Machines) -> subprocess.Popen[str]:
    return subprocess.Popen(
        railui("optimise", study, "-o", out, "--scheduler", machines.address, "-v"),
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def test_a_killed_worker_loses_nothing_and_the_front_is_that_of_one_machine(tmp_path: Path, machines: Machines) -> None:
    study = write_study(tmp_path, length=1000, population=32, generations=8)
    one = machines.workers(2)[0]
    process = spread(study, tmp_path / "many", machines)
    await_results(tmp_path / "many", 1, process)
    one.kill()
    told = process.communicate(timeout=200)[1]
    assert process.returncode == 0, told
    assert run("optimise", study, "-o", tmp_path / "one").returncode == 0
    assert result(tmp_path / "many") == result(tmp_path / "one")


def test_where_the_scheduler_is_killed_what_was_evaluated_is_kept_and_the_same_command_resumes(
    tmp_path: Path, machines: Machines
) -> None:
    study = write_study(tmp_path, length=2000, population=64, generations=20)
    machines.workers(2)
    process = spread(study, tmp_path / "out", machines)
    await_results(tmp_path / "out", 1, process)
    machines.scheduler.send_signal(signal.SIGKILL)
    told = process.communicate(timeout=120)[1]
    assert process.returncode == 3 and "is lost" in told and "the same command resumes" in told
    assert stored(tmp_path / "out") > 0
    status = json.loads(run("status", tmp_path / "out", "--json", "-").stdout)
    assert status["state"] == "interrupted"
    again = run("optimise", study, "-o", tmp_path / "out", "--scheduler", machines.address)
    assert again.returncode == 3 and "no scheduler answers" in again.stderr


@pytest.mark.slow
def test_a_worker_of_another_simd_level_or_version_is_refused(tmp_path: Path, machines: Machines) -> None:
    newer = tmp_path / "newer.py"
    newer.write_text("import railui\nrailui.__version__ = '9.9'\n", "utf-8")
    machines.worker(RAILUI_SIMD="portable")
    machines.worker("--preload", str(newer))
    machines.worker()
    study = write_study(tmp_path, population=8, generations=2)
    time.sleep(4)  # so that all three have joined
    process = spread(study, tmp_path / "many", machines)
    told = process.communicate(timeout=120)[1]
    assert process.returncode == 0, told
    refused = {line for line in told.splitlines() if "refused" in line}  # again, where one was away for a moment
    assert "SIMD level portable, not" in told and "railui 9.9, not" in told and len(refused) == 2
    assert run("optimise", study, "-o", tmp_path / "one").returncode == 0
    assert result(tmp_path / "many") == result(tmp_path / "one")


POISON = """\
import os, signal
from railui.engine import work

clean = getattr(work, "clean", work.do)  # a preload may be read twice
work.clean = clean

def do(case, rows, keys):
    damping = rows[:, case.vehicle.model.columns["vehicle.secondary.yaw_damping"]]
    if case.road.laid.seed == 1 and any((10000 < damping) & (damping < 15000)):
        os.kill(os.getpid(), signal.SIGKILL)
    return clean(case, rows, keys)

work.do = do
"""


@pytest.mark.slow
def test_a_poisonous_case_fails_alone(tmp_path: Path, machines: Machines) -> None:
    poison = tmp_path / "poison.py"
    poison.write_text(POISON, "utf-8")
    for _ in range(2):
        machines.worker("--preload", str(poison), nanny=True)
    study = write_study(tmp_path, length=200, population=16, generations=1)
    process = spread(study, tmp_path / "out", machines)
    told = process.communicate(timeout=250)[1]
    assert process.returncode == 0, told
    found = result(tmp_path / "out")
    assert 0 < found["failures"]["killed its worker"] == found["failed"] < 8
    assert found["pareto"]
