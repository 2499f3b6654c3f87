"""Recordings of track recording cars to tracks."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from railui.capture.formats import read_recordings
from railui.capture.formats.clocks import DISTANCE_NAMES
from railui.cli import cli
from railui.io.problems import FileProblems
from railui.track.reader import load_track


def test_recording_of_a_track_recording_car_becomes_a_track(tmp_path: Path) -> None:
    s = np.arange(0, 500, 0.25)
    rows = "\r\n".join(
        f"{x:.2f};{2 + np.sin(x):.4f};{np.sin(x):.4f};{3.0:.1f};{1438.0:.1f}".replace(".", ",") for x in s
    )
    header = "s [m];align_r [mm];align_l [mm];cross [mm];gauge [mm]\r\n"
    (tmp_path / "car.csv").write_bytes((header + rows + "\r\n").encode("cp1252"))
    text = """\
convention: EN 13848
sensors:
  alignment_right: {channel: align_r}
  alignment_left: {channel: align_l}
  cross_level: {channel: cross}
  gauge: {channel: gauge}
"""
    (tmp_path / "map.yaml").write_text(text)
    arguments = [
        "import",
        str(tmp_path / "car.csv"),
        "--map",
        str(tmp_path / "map.yaml"),
        "-o",
        str(tmp_path / "track.csv"),
    ]
    result = CliRunner().invoke(cli, arguments)
    assert result.exit_code == 0, result.output
    track = load_track(tmp_path / "track.csv")
    assert np.allclose(track.yw, 1e-3 * (1 + np.sin(s)), atol=1e-7)
    assert np.allclose(track.phiw, 0.003 / 1.5) and np.allclose(track.gauge, 0.003)


@pytest.mark.parametrize(
    ("header", "factor", "clock"),
    [
        ("Strecke [km]", 1e-3, ""),
        ("Station [m]", 1.0, ""),
        ("Kilometer [km]", 1e-3, ""),
        ("chainage [m]", 1.0, ""),
        ("Location [m]", 1.0, ""),
        ("PK [km]", 1e-3, ""),
        ("distance", 1.0, ""),
        ("Strecke [km]", 1e-3, "clock: Strecke\n"),
        ("Lauf [km]", 1e-3, "clock: Lauf\n"),
    ],
)
def test_the_distance_is_recognised_by_its_name_or_by_its_unit(
    tmp_path: Path, header: str, factor: float, clock: str
) -> None:
    s = np.arange(0, 500, 0.25)
    rows = "".join(f"{factor * (12e3 + x):.6f},{np.sin(x):.4f}\n" for x in s)
    (tmp_path / "car.csv").write_text(f"{header},Richtung [mm]\n{rows}")
    (tmp_path / "map.yaml").write_text(f"{clock}sensors: {{yw: {{channel: Richtung}}}}\n")
    words = ["import", "car.csv", "--map", "map.yaml", "-o", "track.csv"]
    result = CliRunner().invoke(cli, [str(tmp_path / w) if "." in w else w for w in words])
    assert result.exit_code == 0, result.output
    track = load_track(tmp_path / "track.csv")
    assert np.allclose(track.s, s, atol=1e-6) and np.allclose(track.yw, 1e-3 * np.sin(s), atol=1e-7)


def test_the_draft_for_a_track_has_the_quantities_of_a_track(tmp_path: Path) -> None:
    rows = "".join(f"{k / 4e3},{k % 7}\n" for k in range(400))
    (tmp_path / "car.csv").write_text(f"Strecke [km],Richtung [mm]\n{rows}")
    words = ["import", "car.csv", "--draft", "map.yaml"]
    result = CliRunner().invoke(cli, [str(tmp_path / w) if "." in w else w for w in words])
    assert result.exit_code == 0 and "-o TRACK.csv" in result.output
    text = (tmp_path / "map.yaml").read_text()
    assert "{channel: Richtung}    # one of yw, alignment_right, alignment_left, cross_level, gauge\n" in text
    assert "speed" not in text and "vehicle" not in text


def test_every_name_of_a_distance_is_documented() -> None:
    page = (Path(__file__).parents[3] / "docs" / "capture.md").read_text("utf-8").lower()
    documented = page.partition("is the distance if it is called")[2].partition("(in any case)")[0]
    assert [name for name in DISTANCE_NAMES if not re.search(rf"\b{name}\b", documented)] == []


def test_a_kilometre_without_a_unit_is_not_taken_as_metres(tmp_path: Path) -> None:
    (tmp_path / "car.csv").write_text("PK,yw [mm]\n" + "".join(f"{k / 4e3},0.5\n" for k in range(400)))
    with pytest.raises(FileProblems, match=r"PK: has no unit, .*write `PK \[km\]`"):
        read_recordings(tmp_path / "car.csv")


def test_an_unusable_track_names_its_recording_and_leaves_an_older_file(tmp_path: Path) -> None:
    rows = "".join(f"{5 * k},0.5\n" for k in range(400))  # every 5 m
    (tmp_path / "car.csv").write_text("s [m],yw [mm]\n" + rows)
    (tmp_path / "map.yaml").write_text("sensors: {yw: {channel: yw}}\n")
    (tmp_path / "track.csv").write_text("older")
    words = ["import", "car.csv", "--map", "map.yaml", "-o", "track.csv"]
    result = CliRunner().invoke(cli, [str(tmp_path / w) if "." in w else w for w in words])
    assert result.exit_code == 2 and "car.csv: s: the locations are 5 m apart" in result.output
    assert (tmp_path / "track.csv").read_text() == "older"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["car.csv", "map.yaml", "track.csv"]
