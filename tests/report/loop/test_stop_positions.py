"""Positions of a stop on the record of a rig: one that acts on one side lies where the mass meets it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.loop import close_loop
from railui.report.loop.data import loop_report
from railui.report.loop.stop_positions import StopPosition, position_text
from railui.report.loop.summary import summary_lines

STOP, STIFFNESS = 0.01, 1.5e4  # m, N/m
OTHERS = ("free_play", "cubic_stiffness", "maxwell_damper", "hysteresis", "dry_friction", "quadratic_damper")


def one_sided_rig(folder: Path) -> Path:
    """Campaign of a mass of 10 kg on 4 kN/m and 25 N*s/m, driven by a force, with a stop above only."""
    rng, t = np.random.default_rng(5), np.arange(3000) * 0.004
    for name, rms in (("a", 45.0), ("b", 40.0)):
        f, phase = rng.uniform(0.5, 12.0, 40), rng.uniform(0.0, 2.0 * np.pi, 40)
        wave = np.cos(2.0 * np.pi * f * t[:, None] + phase).sum(axis=1)
        force = CubicSpline(t, rms * wave / wave.std())

        def rate(s: float, x: np.ndarray, u: CubicSpline = force) -> list[float]:
            return [x[1], (u(s) - 4e3 * x[0] - 25.0 * x[1] - STIFFNESS * max(x[0] - STOP, 0.0)) / 10.0]

        z = solve_ivp(rate, (0.0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-7, atol=1e-9, max_step=4e-3).y[0]
        z = z + rng.normal(0.0, 5e-5, len(t))
        rows = [f"{a:.3f},{b:.6f},{c:.8f}" for a, b, c in zip(t, force(t), z, strict=True)]
        (folder / f"{name}.csv").write_text("\n".join(["t [s],u [N],z [m]", *rows]) + "\n")
    (folder / "vehicle.yaml").write_text("name: x\nvehicle: {rig: {mass: 10, stiffness: 3900, damping: 30}}\n")
    (folder / "campaign.yaml").write_text(
        "vehicle: vehicle.yaml\nruns: [{file: a.csv, role: adjust}, {file: b.csv, role: validate}]\n"
    )
    return folder


def test_a_stop_on_one_side_is_reported_where_it_acts_on_the_record(tmp_path: Path) -> None:
    result = close_loop(read_dataset(load_campaign(one_sided_rig(tmp_path))), without=OTHERS, jobs=1)
    (effect,) = result.after.model.effects
    assert effect.kind == "bump_stop" and effect.parameters["gap"] > 2.0 * STOP  # about the position without force
    report = loop_report(result)
    (position,) = report["effects"][0]["positions"]
    assert position["upper"] == pytest.approx(STOP, abs=2e-4)
    assert (position["lower_reached"], position["upper_reached"]) == (False, True)
    assert position["offset"] == pytest.approx(report["means"]["z"])
    assert "of the recorded motion, the only side reached)" in report["sentence"]
    assert any("a stop on one side" in line for line in summary_lines(report))


@pytest.mark.parametrize(
    ("offset", "lower", "upper", "text"),
    [
        (0.0, True, True, ""),
        (2e-5, True, True, ""),
        (1e-3, True, True, " (at -0.00900 and 0.01100 of the recorded motion)"),
        (1e-3, True, False, " (at -0.00900 of the recorded motion, the only side reached)"),
        (1e-3, False, False, ""),
    ],
)
def test_positions_are_told_where_the_gap_does_not_give_them(
    offset: float, lower: bool, upper: bool, text: str
) -> None:
    position = StopPosition("gap", offset, offset - 0.01, offset + 0.01, lower, upper, "1", 1e-4)
    assert position_text(position) == text
