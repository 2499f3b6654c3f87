"""Recordings of track recording cars to tracks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from click.testing import CliRunner

from railui.cli import cli
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
