"""Output of every command: JSON envelope, streams."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from railui.cli.invocation import Invocation, RunLog, StatusLine
from tests.cli.runner import BOGIE, document, run, run_ride


def test_json_begins_with_the_envelope_and_fills_stdout() -> None:
    result = run_ride("--speed", "40", "--json", "-")
    assert result.exit_code == 0, result.output
    found = document(result)
    assert list(found)[:5] == ["schema", "version", "inputs", "seed", "simd"]
    assert found["schema"] == "railui.ride/1" and found["seed"] == 1
    assert found["inputs"][0]["file"] == BOGIE and len(found["inputs"][0]["sha256"]) == 64


def test_the_table_goes_to_stderr_where_json_goes_to_stdout(tmp_path: Path) -> None:
    assert "comfort_hours" in run_ride("--speed", "40").stdout
    result = run_ride("--speed", "40", "--json", "-")
    assert result.stdout.startswith("{") and "ride quality" in result.stderr
    assert run_ride("--speed", "40", "--json", "-", "-q").stderr == ""
    assert run_ride("--speed", "40", "--json", str(tmp_path / "a.json"), "-q").exit_code == 0
    assert json.loads((tmp_path / "a.json").read_text("utf-8"))["steps"] == 1


def test_a_run_log_prints_and_collects_messages_with_the_elapsed_time(capsys: pytest.CaptureFixture[str]) -> None:
    log = RunLog(Invocation())
    log.message("first")
    log.message("second")
    assert [line.split(" s  ")[1] for line in log.lines] == ["first", "second"]
    assert capsys.readouterr().err.splitlines() == log.lines


def test_a_quiet_run_log_collects_without_printing(capsys: pytest.CaptureFixture[str]) -> None:
    log = RunLog(Invocation(quiet=True))
    log.message("first")
    assert len(log.lines) == 1 and capsys.readouterr().err == ""


def test_status_lines_are_rare_without_a_terminal_unless_verbose(capsys: pytest.CaptureFixture[str]) -> None:
    status = StatusLine(Invocation())
    status.message("one of two")
    status.message("two of two")
    assert capsys.readouterr().err.splitlines() == ["one of two"]
    verbose = StatusLine(Invocation(verbose=1))
    verbose.message("one of two")
    verbose.message("two of two")
    assert capsys.readouterr().err.splitlines() == ["one of two", "two of two"]


def test_no_output_overwrites_a_file_that_is_read(tmp_path: Path) -> None:
    line = tmp_path / "line.csv"
    assert run("track", "erri_b176_low", "length=300", "-o", str(line)).exit_code == 0
    before = line.read_bytes()
    for words in (
        ["ride", BOGIE, "--track", str(line), "--speed", "40", "--series", str(line)],
        ["ride", BOGIE, "--track", str(line), "--speed", "40", "--json", str(line)],
        ["track", "--spectrum", str(line), "--json", str(line)],
        ["check", str(line), "--json", str(line)],
    ):
        result = run(*words)
        assert result.exit_code == 2 and "would be overwritten, name another file" in result.stderr, words
        assert line.read_bytes() == before
