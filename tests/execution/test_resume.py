"""Nothing is lost: killed at any moment, a search resumes and finds what it would have found."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import time
from pathlib import Path

import pytest

from railui.execution.cache import Store
from tests.execution.small import railui, result, run, write_study


def start(study: Path, out: Path, jobs: int = 2) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        railui("optimise", study, "-o", out, "--jobs", jobs), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )


def await_results(out: Path, count: int, process: subprocess.Popen[bytes] | subprocess.Popen[str]) -> None:
    """Waits until a running search has kept so many rides; fails where it ends before."""
    until = time.monotonic() + 60
    while not (out / "results.sqlite").exists() or stored(out) < count:
        assert time.monotonic() < until and process.poll() is None, f"{stored(out)} of {count} rides were kept"
        time.sleep(0.01)
    assert process.poll() is None, "the search is too short to be disturbed"


def stored(out: Path) -> int:
    try:
        store = Store(out, readonly=True)
        try:
            return len(store)
        finally:
            store.close()
    except OSError:  # not begun
        return 0


@pytest.mark.parametrize(
    ("most", "fewest", "longest", "generations"),
    [(3, 2, 2.0, 8), pytest.param(50, 50, 1.6, 60, marks=[pytest.mark.slow, pytest.mark.timeout(1800)])],
)
def test_killed_at_random_moments_the_front_is_the_uninterrupted_one_bit_for_bit(
    tmp_path: Path, most: int, fewest: int, longest: float, generations: int
) -> None:
    study = write_study(tmp_path, length=1000, population=32, generations=generations)
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    assert run("optimise", study, "-o", whole).returncode == 0
    began = time.monotonic()
    moments, kills = random.Random(7), 0
    while kills < most:
        before = stored(broken)
        process = start(study, broken)
        time.sleep(moments.uniform(0.3, longest))
        if process.poll() is not None:
            break
        process.send_signal(signal.SIGKILL)
        process.wait()
        kills += 1
        assert stored(broken) >= before  # what was kept stays
    assert kills >= fewest, f"the study is too short to be killed: {time.monotonic() - began:.1f} s, {kills} times"
    assert run("optimise", study, "-o", broken).returncode == 0
    assert result(broken) == result(whole)
    assert (broken / "front.csv").read_bytes() == (whole / "front.csv").read_bytes()
    assert (broken / "knee.yaml").read_bytes() == (whole / "knee.yaml").read_bytes()


def test_a_second_process_is_refused_while_the_first_lives_and_not_when_it_is_dead(tmp_path: Path) -> None:
    study, out = write_study(tmp_path, length=3000, population=128, generations=60), tmp_path / "out"
    first = start(study, out, jobs=1)
    await_results(out, 1, first)
    second = run("optimise", study, "-o", out)
    assert second.returncode == 3 and f"process {first.pid} on" in second.stderr
    assert run("optimise", study, "-o", out, "--unlock").returncode == 3  # it lives
    status = json.loads(run("status", out, "--json", "-").stdout)
    assert status["state"] == "running" and status["eta_s"] > 0
    first.kill()
    first.wait()
    status = json.loads(run("status", out, "--json", "-").stdout)
    assert status["state"] == "interrupted" and status["eta_s"] is None
    third = start(study, out, jobs=1)
    await_results(out, stored(out) + 1, third)
    third.send_signal(signal.SIGINT)
    assert third.wait(20) == 130
    assert third.stderr is not None and b"the same again: railui optimise" in third.stderr.read()


def test_a_lock_from_another_machine_stands_until_unlock_is_said(tmp_path: Path) -> None:
    study, out = write_study(tmp_path, generations=1), tmp_path / "out"
    out.mkdir()
    (out / "lock").write_text(json.dumps({"pid": 17, "host": "elsewhere", "since": "yesterday"}), "utf-8")
    refused = run("optimise", study, "-o", out)
    assert refused.returncode == 3 and "process 17 on elsewhere" in refused.stderr and "--unlock" in refused.stderr
    assert run("optimise", study, "-o", out, "--unlock").returncode == 0
    assert json.loads(run("status", out, "--json", "-").stdout)["state"] == "finished"


def test_another_configuration_is_refused_with_what_changed_and_a_longer_search_goes_on(tmp_path: Path) -> None:
    study, out = write_study(tmp_path, generations=2), tmp_path / "out"
    assert run("optimise", study, "-o", out).returncode == 0
    rides = stored(out)
    study.write_text(study.read_text("utf-8").replace("40 m/s", "35 m/s"), "utf-8")
    refused = run("optimise", study, "-o", out)
    assert refused.returncode == 2 and "cases.speed.0: 40.0 -> 35.0" in refused.stderr
    resumed = run("optimise", out / "study.yaml")  # the configuration as it was frozen
    assert resumed.returncode == 0 and stored(out) == rides
    write_study(tmp_path, generations=3)
    assert run("optimise", study, "-o", out).returncode == 0
    longer = result(out)
    fresh = tmp_path / "fresh"
    assert run("optimise", study, "-o", fresh).returncode == 0
    assert result(fresh) == longer and longer["evaluations"] == 48


def test_a_chosen_design_of_the_front_is_written_and_one_that_is_not_there_refused(tmp_path: Path) -> None:
    study, out = write_study(tmp_path, generations=2), tmp_path / "out"
    assert run("optimise", study, "-o", out, "--choose", 0).returncode == 0
    assert run("check", out / "chosen_0.yaml", out / "knee.yaml", out / "vehicle.yaml").returncode == 0
    refused = run("optimise", study, "-o", out, "--choose", 99)
    assert refused.returncode != 0 and "no design 99 on the front" in refused.stderr


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [(["status", "nowhere"], 2, "nowhere: holds no search"), (["optimise", "nowhere.yaml"], 2, "nowhere.yaml: cannot")],
)
def test_what_is_not_there_is_told(words: list[str], code: int, told: str) -> None:
    done = run(*words)
    assert done.returncode == code and told in done.stderr
