"""Run files of time, speed, track and one response: the loop ends, and cross-level decides what it can name."""

from __future__ import annotations

import csv
import gzip
import shutil
from pathlib import Path

import pytest

import railui
from railui.api.loop import Loop

CAMPAIGN = Path(__file__).parents[2] / "designs" / "campaigns" / "worn_axle_box"
HEAD = "name: one response\ndata: simulated\nvehicle: vehicle.yaml\nruns:\n"


def loop_on(home: Path, *columns: str) -> Loop:
    """Run the loop on the bundled campaign with these columns only and no stated noise, and save it."""
    home.mkdir()
    shutil.copy(CAMPAIGN / "vehicle.yaml", home)
    for name in ("run_a.csv", "run_b.csv"):
        with gzip.open(CAMPAIGN / f"{name}.gz", "rt", encoding="utf-8") as source:
            header, *rows = csv.reader(source)
        chosen = [i for i, text in enumerate(header) if text.split()[0] in columns]
        with (home / name).open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([[row[i] for i in chosen] for row in (header, *rows)])
    runs = "  - {file: run_a.csv, role: adjust}\n  - {file: run_b.csv, role: validate}\n"
    (home / "campaign.yaml").write_text(HEAD + runs, encoding="utf-8")
    found = railui.Campaign.load(home).loop(jobs=2)
    found.save(home / "out")
    return found


@pytest.mark.slow
@pytest.mark.parametrize("response", ["ayf", "ay1"])
def test_cross_level_and_one_accelerometer_suffice(tmp_path: Path, response: str) -> None:
    found = loop_on(tmp_path / "campaign", "t", "v", "yw", "phiw", response)
    (effect,) = found.effects
    assert found.verdict == "effect" and effect.kind == "free_play" and effect.at == "primary_lateral"
    assert effect.parameters["half_width"].value == pytest.approx(0.44e-3, abs=0.02e-3)
    assert not any("cross-level" in note for note in found.data["notes"])


@pytest.mark.slow
@pytest.mark.parametrize("response", ["ayf", "e1", "ay1", "d1"])
def test_without_cross_level_a_verdict_has_a_warning(tmp_path: Path, response: str) -> None:
    """The motion that cross-level causes is then that of an effect, of track noise, or remains."""
    found = loop_on(tmp_path / "campaign", "t", "v", "yw", response)
    assert found.verdict in ("none", "effect", "partial", "outside")
    assert any(note.startswith("no cross-level (phiw) in the runs") for note in found.data["notes"])
    assert (tmp_path / "campaign" / "out" / "report.html").is_file()
