"""A search that is killed at any moment resumes with the result of an uninterrupted one."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from railui.execution.cache import DATABASE, ResultCache
from tests.execution.small import railui, result, run, write_study


def start(study: Path, out: Path, jobs: int = 2) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        railui("optimise", study, "-o", out, "--jobs", jobs), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )


def wait_for_results(out: Path, count: int, process: subprocess.Popen[bytes] | subprocess.Popen[str]) -> None:
    """Wait until a running search has stored so many simulations; fail if it ends before."""
    deadline = time.monotonic() + 60
    while not (out / "results.sqlite").exists() or count_stored(out) < count:
        in_time = time.monotonic() < deadline and process.poll() is None
        assert in_time, f"{count_stored(out)} of {count} simulations were stored"
        time.sleep(0.01)
    assert process.poll() is None, "the search is too short to be disturbed"


def count_stored(out: Path) -> int:
    try:
        cache = ResultCache(out, readonly=True)
        try:
            return len(cache)
        finally:
            cache.close()
    except OSError:  # not started
        return 0


@pytest.mark.parametrize(
    ("max_kills", "min_kills", "max_delay", "generations"),
    [(3, 2, 2.0, 8), pytest.param(50, 50, 1.6, 60, marks=[pytest.mark.slow, pytest.mark.timeout(1800)])],
)
def test_after_kills_at_random_moments_the_front_is_the_same_bit_for_bit(
    tmp_path: Path, max_kills: int, min_kills: int, max_delay: float, generations: int
) -> None:
    study = write_study(tmp_path, length=1000, population=32, generations=generations)
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    assert run("optimise", study, "-o", whole).returncode == 0
    start_time = time.monotonic()
    rng, kills = random.Random(7), 0
    while kills < max_kills:
        stored = count_stored(broken)
        process = start(study, broken)
        time.sleep(rng.uniform(0.3, max_delay))
        if process.poll() is not None:
            break
        process.send_signal(signal.SIGKILL)
        process.wait()
        kills += 1
        assert count_stored(broken) >= stored
    seconds = time.monotonic() - start_time
    assert kills >= min_kills, f"the study is too short to be killed: {seconds:.1f} s, {kills} times"
    assert run("optimise", study, "-o", broken).returncode == 0
    assert result(broken) == result(whole)
    assert (broken / "front.csv").read_bytes() == (whole / "front.csv").read_bytes()
    assert (broken / "knee.yaml").read_bytes() == (whole / "knee.yaml").read_bytes()


KILLED_WHILE_CREATING = """
import os, signal, sqlite3, sys
database = sqlite3.connect(sys.argv[1], isolation_level=None)
for command in ("PRAGMA cache_size=1", "BEGIN", "CREATE TABLE half (value BLOB)"):
    database.execute(command)
for _ in range(50):
    database.execute("INSERT INTO half VALUES (zeroblob(5000))")
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_search_killed_while_it_creates_its_store_begins_anew(tmp_path: Path) -> None:
    study, out = write_study(tmp_path, length=300, population=8, generations=2), tmp_path / "out"
    out.mkdir()
    killed = subprocess.run([sys.executable, "-c", KILLED_WHILE_CREATING, str(out / DATABASE)], check=False)
    assert killed.returncode == -signal.SIGKILL
    assert {f.name for f in out.iterdir()} == {DATABASE, f"{DATABASE}-journal"}
    assert run("optimise", study, "-o", out).returncode == 0
    assert run("optimise", study, "-o", tmp_path / "whole").returncode == 0
    assert count_stored(out) > 0
    assert result(out) == result(tmp_path / "whole")


def test_a_second_process_is_refused_only_while_the_first_is_alive(tmp_path: Path) -> None:
    study, out = write_study(tmp_path, length=3000, population=128, generations=60), tmp_path / "out"
    first = start(study, out, jobs=1)
    wait_for_results(out, 1, first)
    second = run("optimise", study, "-o", out)
    assert second.returncode == 3 and f"process {first.pid} on" in second.stderr
    assert run("optimise", study, "-o", out, "--unlock").returncode == 3  # the first process is alive
    status = json.loads(run("status", out, "--json", "-").stdout)
    assert status["state"] == "running" and status["eta_s"] > 0
    first.kill()
    first.wait()
    status = json.loads(run("status", out, "--json", "-").stdout)
    assert status["state"] == "interrupted" and status["eta_s"] is None
    third = start(study, out, jobs=1)
    wait_for_results(out, count_stored(out) + 1, third)
    third.send_signal(signal.SIGINT)
    assert third.wait(20) == 130
    assert third.stderr is not None and b"the same again: railui optimise" in third.stderr.read()


def test_a_lock_of_another_machine_remains_until_unlock_is_given(tmp_path: Path) -> None:
    study, out = write_study(tmp_path, generations=1), tmp_path / "out"
    out.mkdir()
    (out / "lock").write_text(json.dumps({"pid": 17, "host": "elsewhere", "since": "yesterday"}), "utf-8")
    refused = run("optimise", study, "-o", out)
    assert refused.returncode == 3 and "process 17 on elsewhere" in refused.stderr and "--unlock" in refused.stderr
    assert run("optimise", study, "-o", out, "--unlock").returncode == 0
    assert json.loads(run("status", out, "--json", "-").stdout)["state"] == "finished"


def test_another_configuration_is_refused_but_more_generations_are_not(tmp_path: Path) -> None:
    study, out = write_study(tmp_path, generations=2), tmp_path / "out"
    assert run("optimise", study, "-o", out).returncode == 0
    stored = count_stored(out)
    study.write_text(study.read_text("utf-8").replace("40 m/s", "35 m/s"), "utf-8")
    refused = run("optimise", study, "-o", out)
    assert refused.returncode == 2 and "cases.speed.0: 40.0 -> 35.0" in refused.stderr
    resumed = run("optimise", out / "study.yaml")  # the copy of the configuration
    assert resumed.returncode == 0 and count_stored(out) == stored
    write_study(tmp_path, generations=3)
    assert run("optimise", study, "-o", out).returncode == 0
    longer = result(out)
    fresh = tmp_path / "fresh"
    assert run("optimise", study, "-o", fresh).returncode == 0
    assert result(fresh) == longer and longer["evaluations"] == 48


def test_a_chosen_design_of_the_front_is_written(tmp_path: Path) -> None:
    study, out = write_study(tmp_path, generations=2), tmp_path / "out"
    assert run("optimise", study, "-o", out, "--choose", 0).returncode == 0
    assert run("check", out / "chosen_0.yaml", out / "knee.yaml", out / "vehicle.yaml").returncode == 0
    refused = run("optimise", study, "-o", out, "--choose", 99)
    assert refused.returncode != 0 and "no design 99 on the front" in refused.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [(["status", "nowhere"], 2, "nowhere: holds no search"), (["optimise", "nowhere.yaml"], 2, "nowhere.yaml: cannot")],
)
def test_a_missing_file_or_directory_is_reported(arguments: list[str], code: int, message: str) -> None:
    done = run(*arguments)
    assert done.returncode == code and message in done.stderr
