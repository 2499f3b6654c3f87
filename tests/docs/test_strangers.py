"""What a stranger does wrong in the first hour: one line says what and what to do, in a path with an umlaut too."""

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
from railui.cli.loop import effects_table
from tests.docs.transcript import ROOT

BOGIE, CAMPAIGN = "designs/test_bogie.yaml", "designs/campaigns/worn_axle_box"
TRACK = ["--track", "erri_b176_low length=200"]
PLAY = "{kind: free_play, at: primary_lateral, half_width: 445.2 um}"
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
    "a directory where a campaign belongs": (["loop", "designs"], "holds no campaign.yaml"),
    "a design where profiles belong": (["contact", BOGIE, BOGIE], "is a design, where a profile belongs"),
    "a run where a design is compared": (["diff", BOGIE, f"{CAMPAIGN}/run_a.csv.gz"], "is compressed (gzip)"),
    "a decimal comma in a speed": (["ride", BOGIE, *TRACK, "--speed", "40,5"], "write 40.5"),
    "a decimal comma in a number": (["ride", BOGIE, *TRACK, "--speed", "40", "vehicle.wheel_load=55,5e3"], "'55.5e3'"),
    "points between thousands": (
        ["ride", BOGIE, *TRACK, "--speed", "40", "vehicle.wheel_load=55.000,5 N"],
        "write '55000.5 N'",
    ),
    "mm without their unit": (["curve", BOGIE, "--radius", "600", "--cant-deficiency", "100"], "write '100 mm'"),
    "a directory where JSON goes": (["effects", "--json", "."], "Is a directory), name a file"),
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
    assert done.exit_code == (1 if "--json" in words else 2)
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


def test_a_device_is_written_to_and_not_replaced(home: Path) -> None:
    """A link to /dev/full: were it replaced, only the link would be."""
    Path("full.json").symlink_to("/dev/full")
    done = CliRunner().invoke(cli, ["effects", "--json", "full.json", "-q"], prog_name="railui")
    assert done.exit_code == 1 and Path("full.json").is_char_device()
    assert "full.json: cannot be written (No space left on device), make room there" in done.output


def test_a_pipe_gets_what_is_written(home: Path) -> None:
    os.mkfifo("pipe")
    with subprocess.Popen(["cat", "pipe"], stdout=subprocess.PIPE) as reader:
        done = CliRunner().invoke(cli, ["effects", "--json", "pipe"], prog_name="railui")
        assert reader.stdout is not None and b"railui.effects/1" in reader.stdout.read()
    assert done.exit_code == 0 and Path("pipe").is_fifo()


def test_a_link_stays_a_link_and_rights_stay_as_they_were(home: Path) -> None:
    Path("kept.json").write_text("old", "utf-8")
    Path("kept.json").chmod(0o640)
    Path("link.json").symlink_to("kept.json")
    assert CliRunner().invoke(cli, ["effects", "--json", "link.json"], prog_name="railui").exit_code == 0
    assert Path("link.json").is_symlink() and "railui.effects/1" in Path("kept.json").read_text("utf-8")
    assert Path("kept.json").stat().st_mode & 0o777 == 0o640


STREAMS = {
    "closed": (">&-", {}, 0, ""),
    "full": (">/dev/full", {"PYTHONUNBUFFERED": ""}, 1, "No space left on device), make room where the output goes"),
    "full at once": (">/dev/full", {"PYTHONUNBUFFERED": "1"}, 1, "No space left on device), make room where"),
    "in ASCII": ("", {"PYTHONIOENCODING": "ascii"}, 0, "\\xb5m"),
}


@pytest.mark.parametrize("where, names, code, told", STREAMS.values(), ids=STREAMS)
def test_a_stdout_that_is(home: Path, where: str, names: dict[str, str], code: int, told: str) -> None:
    Path("worn.yaml").write_text(f"{Path(BOGIE).read_text('utf-8')}effects:\n  - {PLAY}\n", "utf-8")
    line = f"{sys.executable} -m railui diff {BOGIE} worn.yaml {where}"
    done = subprocess.run(["sh", "-c", line], env=os.environ | names, capture_output=True, text=True)
    assert done.returncode == code and "Traceback" not in done.stderr
    assert told in done.stdout + done.stderr


def test_a_terminal_that_cannot_draw_is_told_so(home: Path) -> None:
    """The desk on a terminal of our own."""
    other, port = os.openpty()
    done = subprocess.run(
        [sys.executable, "-m", "railui", "desk", BOGIE],
        env=os.environ | {"TERM": "dumb"}, stdin=port, stdout=port, stderr=subprocess.PIPE, text=True, timeout=60,
    )  # fmt: skip
    os.close(port), os.close(other)
    assert done.returncode == 2 and "TERM=dumb: this terminal cannot draw" in done.stderr


def test_effects_beside_an_outside_are_not_called_found() -> None:
    titles = [effects_table({"verdict": verdict, "effects": []}).title for verdict in ("effect", "outside")]
    assert titles == ["effects found", "effects added, which are not the answer"]


@pytest.mark.parametrize("column", ["yw", "e1"])
def test_mm_that_are_called_m_are_told_before_a_fit_diverges(home: Path, column: str) -> None:
    head, *rows = gzip.decompress(Path(CAMPAIGN, "run_b.csv.gz").read_bytes()).decode().splitlines()
    place = head.split(",").index(f"{column} [m]")
    cells = [row.split(",") for row in rows]
    long = [",".join(f"{1e3 * float(x)}" if k == place else x for k, x in enumerate(row)) for row in cells]
    Path("run.csv").write_text("\n".join([head, *long]), "utf-8")
    done = CliRunner().invoke(cli, ["check", "run.csv"], prog_name="railui")
    assert done.exit_code == 2 and f"write `{column} [mm]` where the numbers are mm" in done.output


def test_a_binary_file_is_no_table(home: Path) -> None:
    Path("line.csv").write_bytes(bytes(range(256)) * 20)
    done = CliRunner().invoke(cli, ["ride", BOGIE, "--track", "line.csv", "--speed", "40"], prog_name="railui")
    assert done.exit_code == 2 and "is binary, no CSV" in done.output and len(done.output.splitlines()) == 1


def test_a_tab_in_a_design_is_told(home: Path) -> None:
    Path("tab.yaml").write_text("vehicle:\n\tframe: {mass: 1}\n", "utf-8")
    done = CliRunner().invoke(cli, ["check", "tab.yaml"], prog_name="railui")
    assert "tab.yaml:2:1:" in done.output and "indent by spaces" in done.output


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
