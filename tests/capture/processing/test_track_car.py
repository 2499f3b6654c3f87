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
