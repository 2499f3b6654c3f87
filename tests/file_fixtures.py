"""Fixtures of file tests: a bogie, a small catalogue of effects, synthetic runs."""

from __future__ import annotations

import gzip
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.io.problems import FileProblems, Problem

REPOSITORY = Path(__file__).parents[1]
SHORT_RUN = 15.0  # s
BOGIE = """\
name: test bogie   # declared
vehicle:
  frame:     {mass: 2900, yaw_inertia: 3300}
  wheelset:  {mass: 1850, yaw_inertia: 1050, spin_inertia: 120}
  geometry:  {half_wheelbase: 1.28, half_gauge: 0.75, half_spring_base: 1.0, rolling_radius: 0.46}
  wheel_load: 55 kN
  primary:   {lateral_stiffness: 3.0 MN/m, longitudinal_stiffness: 8 MN/m}
  secondary: {lateral_stiffness: 0.2 MN/m, yaw_stiffness: 0.2 MN*m/rad, lateral_damping: 30 kN*s/m}
contact:
  leading:  {conicity: 0.15, longitudinal_creep: 180, lateral_creep: 165, gravitational_stiffness: 6}
  trailing: {conicity: 0.15, longitudinal_creep: 180, lateral_creep: 165, gravitational_stiffness: 6}
  flange_clearance: 7 mm
"""
CAMPAIGN = """\
name: worn axle box
vehicle: vehicle.yaml
runs:
  - {file: run_a.csv, role: adjust}
  - {file: run_b.csv, role: validate}
noise: {e1: 0.05 mm, rf: 0.3 mrad/s}
"""


def record(kind: str, at: list[str], supersedes: str | None = None, **parameters: tuple[Any, ...]) -> dict[str, Any]:
    """Return a catalogue record; each parameter: unit, default, minimum, maximum, times."""
    keys = ("unit", "default", "minimum", "maximum", "times")
    described = [
        {
            "key": key,
            "symbol": key[0],
            "origin": "",
            "optional": key == "blow_off",
            **dict(zip(keys, p, strict=True)),
        }
        for key, p in parameters.items()
    ]
    return {"kind": kind, "title": kind, "source": "", "at": at, "supersedes": supersedes, "parameters": described}


SUSPENSIONS = ["secondary_lateral", "secondary_yaw", "primary_lateral", "primary_yaw", "rig"]
CATALOGUE = [
    record("spring", [*SUSPENSIONS, "wheelset_yaw"], stiffness=("F/z", 1.0, 0.0, 100.0, "k")),
    record("free_play", SUSPENSIONS, "stiffness", half_width=("z", 0.06, 0.0, 2.0, "z")),
    record("quadratic_damper", SUSPENSIONS, damping=("F*s^2/z^2", 1.0, 0.0, 1e3, "c/v")),
    record("maxwell_damper", SUSPENSIONS, stiffness=("F/z", 1.0, 0.01, 100.0, "k"),
           damping=("F*s/z", 1.0, 0.001, 100.0, "k/w"), blow_off=("F", 1e9, 0.001, 1e9, "F")),
    record("creep_saturation", ["contact"], friction=("1", 0.35, 0.01, 1.0, "1")),
    record("flange_contact", ["contact"], clearance=("m", 1.0, 0.1, 3.0, "h"),
           stiffness=("N/m", 14.6e6, 1e5, 1e8, "1")),
    record("gauge_conicity", ["contact"], per_gauge=("1/m", -15.0, -100.0, 100.0, "1")),
    record("coach_mode", ["secondary_lateral"], "stiffness_and_damping", mass=("kg", 5.0, 0.1, 30.0, "m"),
           stiffness=("F/z", 1.0, 0.01, 100.0, "k")),
    record("measured_force", ["primary_lateral", "secondary_yaw", "rig"], motion=("z", 0.0, -1e9, 1e9, "1"),
           force=("F", 0.0, -1e9, 1e9, "1")),
    record("sensor_gain", ["e1", "ay1", "z"], gain=("1", 1.0, -3.0, 3.0, "1")),
    record("sensor_offset", ["e1", "ay1", "z"], offset=("z", 0.0, -1e3, 1e3, "1")),
]  # fmt: skip


@pytest.fixture
def bogie() -> str:
    """Text of a design with units."""
    return BOGIE


@pytest.fixture
def catalogue() -> list[dict[str, Any]]:
    """Catalogue of some effects."""
    return CATALOGUE


@pytest.fixture
def shared() -> Path:
    """Directory of shared runs next to the checkout; skip the test if it is absent."""
    folder = Path(__file__).resolve().parents[1].parent / "shared" / "runs"
    if not folder.is_dir():
        pytest.skip("no shared runs beside the checkout")
    return folder


@pytest.fixture
def problems_of() -> Callable[[Callable[[], object]], list[Problem]]:
    """Collect the problems with which a call is refused."""

    def problems(call: Callable[[], object]) -> list[Problem]:
        with pytest.raises(FileProblems) as caught:
            call()
        return list(caught.value.problems)

    return problems


def run_rows(seconds: float = 20.0, rate: float = 50.0, seed: int = 0) -> dict[str, np.ndarray]:
    """Return the columns of a run with noise in every channel, by header."""
    n = round(seconds * rate)
    t, wave = np.arange(n) / rate, np.random.default_rng(seed)
    names = ("yw [m]", "e1 [m]", "ay1 [m/s^2]")
    return {
        "t [s]": t,
        "v [m/s]": np.full(n, 40.0),
        **{name: 1e-3 * wave.standard_normal(n) for name in names},
    }


def csv(columns: dict[str, np.ndarray], separator: str = ",") -> str:
    """Return a table as CSV text."""
    rows = zip(*columns.values(), strict=True)
    return "\n".join([separator.join(columns), *(separator.join(f"{x:.9g}" for x in row) for row in rows)]) + "\n"


@pytest.fixture
def columns() -> Callable[..., dict[str, np.ndarray]]:
    """Function that returns the columns of a run."""
    return run_rows


@pytest.fixture
def as_csv() -> Callable[..., str]:
    """Function that returns a table as CSV text."""
    return csv


@pytest.fixture
def campaign_folder(tmp_path: Path) -> Path:
    """Directory of a campaign with its vehicle and two runs."""
    (tmp_path / "vehicle.yaml").write_text(BOGIE)
    (tmp_path / "campaign.yaml").write_text(CAMPAIGN)
    for seed, name in enumerate(("run_a.csv", "run_b.csv")):
        rf = np.sin((1.0 + seed) * np.arange(1000.0))
        (tmp_path / name).write_text(csv({**run_rows(seed=seed), "rf [rad/s]": rf}))
    return tmp_path


@pytest.fixture
def short_campaign(tmp_path: Path) -> Path:
    """Copy of a bundled campaign with the first SHORT_RUN seconds of its runs, whose loop takes a third of the time."""
    directory = Path(shutil.copytree(REPOSITORY / "designs/campaigns/worn_axle_box", tmp_path / "campaign"))
    for file in directory.glob("*.csv.gz"):
        head, *rows = gzip.decompress(file.read_bytes()).decode().splitlines()
        kept = [row for row in rows if float(row.split(",")[0]) < SHORT_RUN]
        file.write_bytes(gzip.compress("\n".join([head, *kept, ""]).encode(), 1))
    return directory
