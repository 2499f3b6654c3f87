"""What a stranger does wrong in the first hour: one line says what and what to do, in a path with an umlaut too."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tty
from pathlib import Path

import pytest
from click.testing import CliRunner

from railui.cli import cli
from tests.docs.transcript import ROOT

BOGIE, CAMPAIGN = "designs/test_bogie.yaml", "designs/campaigns/worn_axle_box"
TRACK = ["--track", "erri_b176_low length=200"]
WRONG = {
    "wrong order: the search before the loop": (
        ["optimise", "designs/studies/worn_axle_box.yaml"],
        "run the loop first",
    ),
    "a campaign where a design belongs": (
        ["ride", f"{CAMPAIGN}/campaign.yaml", *TRACK, "--speed", "40"],
        "is a campaign",
    ),
    "a run where a design belongs": (["stability", f"{CAMPAIGN}/run_a.csv.gz"], "is a run, where a design belongs"),
    "a design where a campaign belongs": (["loop", BOGIE], "is a design, where a campaign belongs"),
    "a design where a study belongs": (["optimise", BOGIE], "is a design, where a study belongs"),
    "a design where a track belongs": (["ride", BOGIE, "--track", BOGIE, "--speed", "40"], "is no table of a track"),
    "a file that is not there": (["ride", "designs/test bögie.yaml", *TRACK, "--speed", "40"], "No such file"),
    "a directory": (["ride", "designs", *TRACK, "--speed", "40"], "a directory"),
    "a decimal comma in a speed": (["ride", BOGIE, *TRACK, "--speed", "40,5"], "write 40.5"),
    "a decimal comma in a number": (["ride", BOGIE, *TRACK, "--speed", "40", "vehicle.wheel_load=55,5e3"], "'55.5e3'"),
    "km/h without their unit": (["ride", BOGIE, *TRACK, "--speed", "144"], "were km/h meant?"),
    "a slip in a path": (
        ["curve", BOGIE, "--radius", "600", "vehicle.weel_load=1"],
        "did you mean 'vehicle.wheel_load'?",
    ),
    "a slip in a track": (["ride", BOGIE, "--track", "erri_b176_lo", "--speed", "40"], "did you mean erri_b176_low?"),
    "a slip in a command": (["rid", BOGIE], "did you mean 'ride'?"),
    "a figure of no kind": (["stability", BOGIE, "--figure", "s.xyz"], ".svg, .png or .pdf"),
    "no terminal": (["desk", BOGIE], "needs a terminal"),
}


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory of a stranger, 80 columns wide."""
    place = tmp_path / "für Züge 1"
    shutil.copytree(ROOT / "designs", place / "designs")
    monkeypatch.chdir(place)
    monkeypatch.setenv("COLUMNS", "80")
    return place


@pytest.mark.parametrize("words, told", WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_told_with_its_remedy(home: Path, words: list[str], told: str) -> None:
    done = CliRunner().invoke(cli, words, prog_name="railui")
    lines = [line for line in done.output.splitlines() if line.strip()]
    assert done.exit_code == 2
    assert told in " ".join(done.output.split())
    assert len(lines) <= 6, "one fault, not a page of them"


@pytest.mark.parametrize("words", [
    ["ride", BOGIE, *TRACK, "--speed", "40"], ["stability", BOGIE, "--speeds", "20:40:20"], ["check", CAMPAIGN],
])  # fmt: skip
def test_a_path_with_a_space_and_an_umlaut_is_a_path(home: Path, words: list[str]) -> None:
    done = CliRunner().invoke(cli, words, prog_name="railui")
    assert done.exit_code == 0, done.output
    assert "\x1b[" not in done.output, "no colours where there is no terminal"


def test_a_directory_that_may_not_be_written_is_told(home: Path) -> None:
    """/proc takes no files, whoever asks."""
    done = CliRunner().invoke(cli, ["track", "erri_b176_low", "length=200", "-o", "/proc/line.csv"], prog_name="railui")
    assert done.exit_code == 1
    assert "/proc/line.csv: cannot be written" in done.output


@pytest.mark.parametrize("words", [
    ["loop", CAMPAIGN, "-o", "/proc/found"],
    ["optimise", "designs/studies/test_bogie.yaml", "-o", "/proc/found"],
    ["stability", BOGIE, "--figure", "/proc/s.png"],
    ["ride", BOGIE, *TRACK, "--speed", "40", "--json", "/proc/a.json"],
    ["capture", "--demo", "-o", "/proc/found"],
], ids=lambda words: words[0])  # fmt: skip
def test_what_cannot_be_written_is_told_before_the_work(home: Path, words: list[str]) -> None:
    done = CliRunner().invoke(cli, words, prog_name="railui")
    assert done.exit_code == 1
    assert len(done.output.splitlines()) == 1
    assert "cannot be written" in done.output and "name a place that you may write" in done.output


def test_a_logger_that_is_silent_is_asked_for(home: Path) -> None:
    """A port to which nothing is connected: a terminal of our own whose other end says nothing."""
    other, port = os.openpty()
    tty.setraw(port)
    done = CliRunner().invoke(cli, ["capture", os.ttyname(port), "-o", "got", "--seconds", "6"], prog_name="railui")
    os.close(other)
    assert "no byte has come in 5 s: is the logger on" in done.output


def test_a_machine_without_what_the_build_needs_is_told_all_of_it(tmp_path: Path) -> None:
    old = tmp_path / "rustc"
    old.write_text("#!/bin/sh\necho 'rustc 1.63.0 (4b91a6ea7 2022-08-08)'\n", "utf-8")
    shutil.copy(old, tmp_path / "cargo")
    for tool in (old, tmp_path / "cargo"):
        tool.chmod(0o755)
    for path, lacks in (("", "cargo is missing"), (str(tmp_path), "rustc is 1.63, 1.89 is needed")):
        done = subprocess.run(
            [sys.executable, ROOT / "release/needs.py"], env={"PATH": path}, capture_output=True, text=True
        )
        assert done.returncode == 1 and lacks in done.stderr and "cc is missing" in done.stderr
        assert "rustup.rs" in done.stderr and "Traceback" not in done.stderr
