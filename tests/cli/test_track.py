"""railui track: synthetic tracks and their analysis."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.runner import document, run


def test_a_track_is_written_and_its_spectrum_analysed(tmp_path: Path) -> None:
    file = str(tmp_path / "line.csv")
    assert run("track", "erri_b176_low", "length=2000", "seed=1", "-o", file).exit_code == 0
    found = document(run("track", "--spectrum", file, "--json", "-"))
    assert [(b["from"], b["to"]) for b in found["bands"]] == [(3.0, 25.0), (25.0, 70.0), (70.0, 150.0)]
    assert [b["sd_yw"] for b in found["bands"]] == pytest.approx([0.714e-3, 1.197e-3, 1.539e-3], rel=0.15)
    assert found["nearest"]["name"] == "erri_b176_low" and found["inputs"][0]["file"] == file
    assert len(found["spectrum"]["yw"]) == len(found["spectrum"]["wavenumber"])
    assert run("track", "erri_b176_low").exit_code == 2
    assert run("track", "erri_b176_low", "lenght=2", "-o", file).exit_code == 2


def test_a_track_on_stdout_equals_that_in_a_file(tmp_path: Path) -> None:
    words = ("track", "fra_4", "length=200", "--seed", "3")
    assert run(*words, "-o", str(tmp_path / "a.csv")).exit_code == 0
    assert run(*words, "-o", "-").stdout == (tmp_path / "a.csv").read_text("utf-8")
