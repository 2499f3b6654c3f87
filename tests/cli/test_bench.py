"""railui bench: the standard job and its log."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.runner import document, run


def test_the_standard_job_is_timed() -> None:
    found = document(run("bench", "--repetitions", "1", "--json", "-"))
    for job in ("full", "reduced"):
        assert found[job]["ns_per_design_step"] == pytest.approx(1e9 / (found[job]["designs_per_second"] * 19999))
    assert {"lanes", "simd", "threads", "alone", "comfort_ns_per_design_step", "crossing_us_per_call"} <= set(found)
    assert [row["threads"] for row in found["scaling"]] == list(range(1, found["threads"] + 1))
    assert found["peak"] is None or found["peak"]["full"]["share"] > 0


def test_a_logged_result_is_compared_with_the_last_complete_entry(tmp_path: Path) -> None:
    file = tmp_path / "new" / "history.jsonl"
    words = ("bench", "--repetitions", "1", "--keep", str(file))
    assert "first entry of this machine" in run(*words).stdout
    file.write_text(file.read_text("utf-8") + '{"half a line', "utf-8")
    stdout = run(*words).stdout
    assert "ns per vehicle time step, since" in stdout and "coach: " in stdout
    last = json.loads(file.read_text("utf-8").splitlines()[-1])
    assert set(last["numbers"]) == {"full", "reduced", "coach"} and last["date"] and last["machine"]
