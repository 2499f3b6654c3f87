"""Errors of first use: one line states the problem and the remedy, also for paths with spaces and umlauts."""

from __future__ import annotations

import gzip
import os
import shutil
import subprocess
import sys
import tty
from pathlib import Path

import pytest
from click.testing import CliRunner

from railui.cli import cli
from railui.cli.identification_tables import effects_table
from tests.docs.transcript import ROOT

BOGIE, CAMPAIGN = "designs/test_bogie.yaml", "designs/campaigns/worn_axle_box"
TRACK = ["--track", "erri_b176_low length=200"]
CLEARANCE = "{kind: free_play, at: primary_lateral, half_width: 445.2 um}"
ERRORS = {
    "the search before the loop": (
        ["optimise", "designs/studies/worn_axle_box.yaml"],
        "run the loop first",
    ),
    "a campaign as a design": (
        ["ride", f"{CAMPAIGN}/campaign.yaml", *TRACK, "--speed", "40"],
        "is a campaign",
    ),
    "a run as a design": (["stability", f"{CAMPAIGN}/run_a.csv.gz"], "is a run, but a design is required"),
    "a design as a campaign": (["loop", BOGIE], "is a design, but a campaign is required"),
    "a design as a study": (["optimise", BOGIE], "is a design, but a study is required"),
    "a design as a track": (
        ["ride", BOGIE, "--track", BOGIE, "--speed", "40"],
        "is a design, but a track or a line is required",
    ),
    "a missing file": (["ride", "designs/test bögie.yaml", *TRACK, "--speed", "40"], "No such file"),
    "a directory as a design": (["ride", "designs", *TRACK, "--speed", "40"], "a directory"),
    "a directory as a campaign": (["loop", "designs"], "holds no campaign.yaml"),
    "a design as a profile": (["contact", BOGIE, BOGIE], "is a design, but a profile is required"),
    "a run compared with a design": (["diff", BOGIE, f"{CAMPAIGN}/run_a.csv.gz"], "is compressed (gzip)"),
    "a decimal comma in a speed": (["ride", BOGIE, *TRACK, "--speed", "40,5"], "write 40.5"),
    "a decimal comma in a number": (["ride", BOGIE, *TRACK, "--speed", "40", "vehicle.wheel_load=55,5e3"], "'55.5e3'"),
    "a thousands separator": (
        ["ride", BOGIE, *TRACK, "--speed", "40", "vehicle.wheel_load=55.000,5 N"],
        "write '55000.5 N'",
    ),
    "mm without a unit": (["curve", BOGIE, "--radius", "600", "--cant-deficiency", "100"], "write '100 mm'"),
    "a directory as JSON output": (["effects", "--json", "."], "Is a directory), name a file"),
    "km/h without a unit": (["ride", BOGIE, *TRACK, "--speed", "144"], "is it in km/h?"),
    "a misspelt path": (
        ["curve", BOGIE, "--radius", "600", "vehicle.weel_load=1"],
        "did you mean 'vehicle.wheel_load'?",
    ),
    "a misspelt track": (["ride", BOGIE, "--track", "erri_b176_lo", "--speed", "40"], "did you mean erri_b176_low?"),
    "a misspelt command": (["rid", BOGIE], "did you mean 'ride'?"),
    "an unknown figure format": (["stability", BOGIE, "--figure", "s.xyz"], ".svg, .png or .pdf"),
    "no terminal": (["desk", BOGIE], "needs a terminal"),
}


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to a new directory with the bundled designs; the terminal is 80 columns wide."""
    directory = tmp_path / "für Züge 1"
    shutil.copytree(ROOT / "designs", directory / "designs")
    monkeypatch.chdir(directory)
    monkeypatch.setenv("COLUMNS", "80")
    return directory


@pytest.mark.parametrize("words, message", ERRORS.values(), ids=ERRORS)
def test_an_error_has_one_short_message_with_a_remedy(home: Path, words: list[str], message: str) -> None:
    done = CliRunner().invoke(cli, words, prog_name="railui")
    lines = [line for line in done.output.splitlines() if line.strip()]
    assert done.exit_code == (1 if "--json" in words else 2)
    assert message in " ".join(done.output.split())
    assert len(lines) <= 6, "one problem, not a page of messages"


@pytest.mark.parametrize("words", [
    ["ride", BOGIE, *TRACK, "--speed", "40"], ["stability", BOGIE, "--speeds", "20:40:20"], ["check", CAMPAIGN],
])  # fmt: skip
def test_paths_may_contain_spaces_and_umlauts(home: Path, words: list[str]) -> None:
    done = CliRunner().invoke(cli, words, prog_name="railui")
    assert done.exit_code == 0, done.output
    assert "\x1b[" not in done.output, "no colours without a terminal"


def test_an_output_directory_without_write_access_is_reported(home: Path) -> None:
    """Write to /proc, which accepts files from no user."""
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
def test_an_output_that_cannot_be_written_stops_the_command_at_its_start(home: Path, words: list[str]) -> None:
    done = CliRunner().invoke(cli, words, prog_name="railui")
    assert done.exit_code == 1
    assert len(done.output.splitlines()) == 1
    assert "cannot be written" in done.output and "name a directory that you may write to" in done.output


def test_a_device_is_written_to_and_not_replaced(home: Path) -> None:
    """Write to a link to /dev/full, so that a failing test replaces only the link."""
    Path("full.json").symlink_to("/dev/full")
    done = CliRunner().invoke(cli, ["effects", "--json", "full.json", "-q"], prog_name="railui")
    assert done.exit_code == 1 and Path("full.json").is_char_device()
    assert "full.json: cannot be written (No space left on device), make room there" in done.output


def test_a_named_pipe_receives_the_output(home: Path) -> None:
    os.mkfifo("pipe")
    with subprocess.Popen(["cat", "pipe"], stdout=subprocess.PIPE) as reader:
        done = CliRunner().invoke(cli, ["effects", "--json", "pipe"], prog_name="railui")
        assert reader.stdout is not None and b"railui.effects/1" in reader.stdout.read()
    assert done.exit_code == 0 and Path("pipe").is_fifo()


def test_writing_keeps_symbolic_links_and_permissions(home: Path) -> None:
    Path("target.json").write_text("old", "utf-8")
    Path("target.json").chmod(0o640)
    Path("link.json").symlink_to("target.json")
    assert CliRunner().invoke(cli, ["effects", "--json", "link.json"], prog_name="railui").exit_code == 0
    assert Path("link.json").is_symlink() and "railui.effects/1" in Path("target.json").read_text("utf-8")
    assert Path("target.json").stat().st_mode & 0o777 == 0o640


STREAMS = {
    "closed": (">&-", {}, 0, ""),
    "full": (">/dev/full", {"PYTHONUNBUFFERED": ""}, 1, "No space left on device), make room where the output goes"),
    "full at once": (">/dev/full", {"PYTHONUNBUFFERED": "1"}, 1, "No space left on device), make room where"),
    "in ASCII": ("", {"PYTHONIOENCODING": "ascii"}, 0, "\\xb5m"),
}


@pytest.mark.parametrize("redirection, environment, code, message", STREAMS.values(), ids=STREAMS)
def test_stdout_that_is(home: Path, redirection: str, environment: dict[str, str], code: int, message: str) -> None:
    Path("worn.yaml").write_text(f"{Path(BOGIE).read_text('utf-8')}effects:\n  - {CLEARANCE}\n", "utf-8")
    line = f"{sys.executable} -m railui diff {BOGIE} worn.yaml {redirection}"
    done = subprocess.run(["sh", "-c", line], env=os.environ | environment, capture_output=True, text=True)
    assert done.returncode == code and "Traceback" not in done.stderr
    assert message in done.stdout + done.stderr


def test_the_desk_refuses_a_terminal_that_cannot_draw(home: Path) -> None:
    """Open the desk on a pseudo-terminal of type "dumb"."""
    other, port = os.openpty()
    done = subprocess.run(
        [sys.executable, "-m", "railui", "desk", BOGIE],
        env=os.environ | {"TERM": "dumb"}, stdin=port, stdout=port, stderr=subprocess.PIPE, text=True, timeout=60,
    )  # fmt: skip
    os.close(port), os.close(other)
    assert done.returncode == 2 and "TERM=dumb: this terminal cannot draw" in done.stderr


def test_the_title_of_the_table_of_effects_counts_them() -> None:
    effect = {"kind": "free_play", "at": "primary_lateral", "wheelset": None, "parameters": {}, "phases": []}
    titles = [effects_table({"effects": [effect] * count}).title for count in (1, 2)]
    assert titles == ["identified effect", "identified effects"]


@pytest.mark.parametrize("column", ["yw", "e1"])
def test_values_in_mm_in_a_column_in_m_are_reported(home: Path, column: str) -> None:
    head, *rows = gzip.decompress(Path(CAMPAIGN, "run_b.csv.gz").read_bytes()).decode().splitlines()
    index = head.split(",").index(f"{column} [m]")
    cells = [row.split(",") for row in rows]
    scaled = [",".join(f"{1e3 * float(x)}" if k == index else x for k, x in enumerate(row)) for row in cells]
    Path("run.csv").write_text("\n".join([head, *scaled]), "utf-8")
    done = CliRunner().invoke(cli, ["check", "run.csv"], prog_name="railui")
    assert done.exit_code == 2 and f"write `{column} [mm]` where the numbers are mm" in done.output


def test_a_foreign_file_in_the_place_of_a_run_leads_to_the_import(home: Path) -> None:
    Path("drive.csv").write_text("Zeit;Weg;RL1_y\nms;m;g\n0;0;0,04\n5;0,2;0,05\n", "utf-8")
    done = CliRunner().invoke(cli, ["check", "drive.csv"], prog_name="railui")
    shutil.copy("drive.csv", "second.csv")
    runs = "[{file: drive.csv, role: adjust}, {file: second.csv, role: validate}]"
    Path("campaign.yaml").write_text(f"vehicle: designs/test_bogie.yaml\nruns: {runs}\n", "utf-8")
    looped = CliRunner().invoke(cli, ["loop", "campaign.yaml"], prog_name="railui")
    for output in (done.output, looped.output):
        assert "`railui import drive.csv --draft map.yaml`" in output and "is not a number" not in output


def test_a_missing_group_is_suggested_with_its_required_keys(home: Path) -> None:
    Path("new.yaml").write_text("vehicle:\n  frame: {mass: 2900, yaw_inertia: 3300}\n", "utf-8")
    done = CliRunner().invoke(cli, ["check", "new.yaml"], prog_name="railui")
    assert "add `wheelset: {mass: 1850 kg, yaw_inertia: 1050 kg*m^2}`" in done.output
    assert "add `contact: {leading: {conicity: 0.15, longitudinal_creep: 180," in done.output


def test_a_binary_file_is_not_accepted_as_a_track(home: Path) -> None:
    Path("line.csv").write_bytes(bytes(range(256)) * 20)
    done = CliRunner().invoke(cli, ["ride", BOGIE, "--track", "line.csv", "--speed", "40"], prog_name="railui")
    assert done.exit_code == 2 and "is binary, not CSV" in done.output and len(done.output.splitlines()) == 1


def test_a_tab_in_a_design_is_reported_with_its_line(home: Path) -> None:
    Path("tab.yaml").write_text("vehicle:\n\tframe: {mass: 1}\n", "utf-8")
    done = CliRunner().invoke(cli, ["check", "tab.yaml"], prog_name="railui")
    assert "tab.yaml:2:1:" in done.output and "replace the tab by spaces" in done.output


def test_a_silent_logger_is_reported(home: Path) -> None:
    """Record from a pseudo-terminal to which nothing is sent."""
    other, port = os.openpty()
    tty.setraw(port)
    done = CliRunner().invoke(cli, ["capture", os.ttyname(port), "-o", "got", "--seconds", "6"], prog_name="railui")
    os.close(other)
    assert "no byte has come in 5 s: is the logger on" in done.output


def test_the_build_lists_every_missing_tool(tmp_path: Path) -> None:
    old = tmp_path / "rustc"
    old.write_text("#!/bin/sh\necho 'rustc 1.63.0 (4b91a6ea7 2022-08-08)'\n", "utf-8")
    shutil.copy(old, tmp_path / "cargo")
    for tool in (old, tmp_path / "cargo"):
        tool.chmod(0o755)
    for path, message in (("", "cargo is missing"), (str(tmp_path), "rustc is 1.63, 1.89 is needed")):
        done = subprocess.run(
            [sys.executable, ROOT / "release/check_build_tools.py"], env={"PATH": path}, capture_output=True, text=True
        )
        assert done.returncode == 1 and message in done.stderr and "cc is missing" in done.stderr
        assert "rustup.rs" in done.stderr and "Traceback" not in done.stderr
