"""Calibration on S1002: a model with the table of its profiles reaches the noise floor, a linear one does not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import railui
from railui.cli import cli
from railui.vehicle.design_reader import load_design
from tests.docs.results import rows_of, undocumented_keys

DESIGNS = Path(__file__).parents[2] / "designs"
NOISE = {"e1": 5e-5, "e2": 5e-5, "ay1": 0.05, "ay2": 0.05, "ayf": 0.02, "rf": 3e-4, "d1": 2e-5, "d2": 2e-5}
UNITS = {"t": "s", "v": "m/s", "yw": "m", "phiw": "rad", "e1": "m", "e2": "m", "ay1": "m/s^2", "ay2": "m/s^2",
         "ayf": "m/s^2", "rf": "rad/s", "d1": "m", "d2": "m"}  # fmt: skip


def measure(path: Path, seed: int, speed: float) -> None:
    """A run of the bogie on S1002 and 60E1, with noise."""
    track = railui.synthetic_track("erri_b176_high", length=1200.0, seed=seed)
    result = railui.simulate(load_design(DESIGNS / "profiled_bogie.yaml"), track, speed)
    n = len(result["e1"])
    rng = np.random.default_rng(seed)
    columns = {"t": result["t"], "v": np.full(n, speed), "yw": track.yw[:n], "phiw": track.phiw[:n]}
    columns |= {c: result[c] + sd * rng.standard_normal(n) for c, sd in NOISE.items()}
    header = ",".join(f"{c} [{UNITS[c]}]" for c in columns)
    np.savetxt(path, np.stack(list(columns.values()), 1), "%.9g", ",", header=header, comments="")


@pytest.mark.parametrize(("use", "least", "most"), [("table", 0.0, 0.05), ("linearised", 0.2, 0.6)])
def test_a_bogie_with_measured_profiles_is_identified(tmp_path: Path, use: str, least: float, most: float) -> None:
    for name, seed, speed in (("a", 1, 40.0), ("b", 2, 36.0)):
        measure(tmp_path / f"{name}.csv", seed, speed)
    text = (DESIGNS / "profiled_bogie.yaml").read_text("utf-8").replace("use: table", f"use: {use}")
    text = text.replace("profiles/", f"{DESIGNS.as_posix()}/profiles/")
    text = text.replace("lateral_stiffness: 3.0 MN/m", "lateral_stiffness: 3.4 MN/m")
    (tmp_path / "vehicle.yaml").write_text(text.replace("yaw_damping: 30 kN", "yaw_damping: 24 kN"), "utf-8")
    noise = ", ".join(f"{c}: {sd:g} {UNITS[c]}" for c, sd in NOISE.items())
    (tmp_path / "campaign.yaml").write_text(
        "name: profiles\nvehicle: vehicle.yaml\nruns:\n  - {file: a.csv, role: adjust}\n"
        f"  - {{file: b.csv, role: validate}}\nnoise: {{{noise}}}\n"
    )
    result = CliRunner().invoke(cli, ["adjust", str(tmp_path), "-q", "--json", str(tmp_path / "result.json")])
    assert result.exit_code == 0, result.output
    identified = json.loads((tmp_path / "result.json").read_text("utf-8"))
    printed = " ".join(result.stdout.split())
    assert "┃ nominal ┃ profiles ┃ calibrated ┃" in printed and "on 60e1.txt" in printed
    assert least < identified["before"]["nrmse"] < most
    assert undocumented_keys([identified], rows_of("loop", "adjust")) == []
    if use == "table":
        values = {path: p["value"] for path, p in identified["parameters"].items()}
        assert values["vehicle.primary.lateral_stiffness"] == pytest.approx(3.0e6, rel=0.01)
        assert values["vehicle.secondary.yaw_damping"] == pytest.approx(30e3, rel=0.03)
