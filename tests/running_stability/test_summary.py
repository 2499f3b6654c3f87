"""Stability summary: speed limit by ride criteria and the command."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from railui.cli import cli
from railui.ride_quality.evaluation import ride
from railui.running_stability.summary import stability
from railui.vehicle.design_reader import load_design
from railui.vehicle.effects import PlacedEffect

HOME = Path(__file__).parents[2]


CHECK = load_design(HOME / "designs/check_bogie.yaml")


SLIPPERY = PlacedEffect("creep_saturation", "contact", None, {"friction": 0.15})


FLANGE = PlacedEffect("flange_contact", "contact", None, {})


def test_the_practical_critical_speed_is_the_last_admissible_one() -> None:
    design = CHECK.with_effects([SLIPPERY, FLANGE])
    result = stability(design, [40.0, 50.0, 60.0, 70.0], track="erri_b176_low length=600")
    v = result["practical_critical_speed"]
    good = ("very good", "good", "satisfactory", "just admissible")
    assert ride(design, "erri_b176_low length=600", v)["class"] in good
    assert ride(design, "erri_b176_low length=600", v + 0.1)["class"] not in good


def test_the_command_prints_all_critical_speeds_in_one_table(tmp_path: Path) -> None:
    text = (HOME / "designs/check_bogie.yaml").read_text("utf-8")
    (tmp_path / "hard.yaml").write_text(
        text + "effects: [{kind: creep_saturation, at: contact, friction: 0.15}, {kind: flange_contact, at: contact}]\n"
    )
    files = ["--json", str(tmp_path / "s.json"), "--figure", str(tmp_path / "s.svg")]
    words = ["stability", str(tmp_path / "hard.yaml"), "--speeds", "50:70:10", "--fold", *files]
    words += ["--track", "erri_b176_low length=600"]
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == 0, done.output
    result = json.loads((tmp_path / "s.json").read_text())
    assert list(result)[:5] == ["schema", "version", "inputs", "seed", "simd"]
    assert result["linear_critical_speed"] == pytest.approx(61.64024, abs=5e-6)
    assert result["practical_critical_speed"] < result["fold_speed"] < result["linear_critical_speed"]
    assert {"speed", "real", "imag", "decrement"} <= set(result["modes"][0])
    assert (tmp_path / "s.svg").read_text().count("<svg") == 1


def test_the_table_and_the_note_rank_modes_by_their_damping_ratio(tmp_path: Path) -> None:
    """A slow motion of the carbody decays more slowly than the frame, with a greater damping ratio."""
    design, file = str(HOME / "designs/bogie_under_coach.yaml"), str(tmp_path / "s.json")
    words = ["--speeds", "5,10", "--json", file]
    done = CliRunner().invoke(cli, ["stability", design, *words])
    result = json.loads(Path(file).read_text())
    mode = result["linear_damping_mode"]
    assert mode in result["modes"] and mode["damping"] == result["linear_damping"]
    slowest = max((m for m in result["modes"] if m["speed"] == mode["speed"]), key=lambda m: m["real"])
    assert slowest["damping"] > mode["damping"]
    note = f"{mode['damping']:.4f}, at {mode['speed']:g} m/s: {mode['frequency']:.3f} Hz, {mode['shape']}"
    assert note in done.output
    [row] = [line for line in done.output.splitlines() if line.startswith(f"│ {mode['speed']:g} ")]
    assert f"{mode['damping']:.4f}" in row


def test_the_command_rejects_invalid_input() -> None:
    for words in (["--speeds", "150"], ["--speeds", "60:20:5"], ["--track", "erri_b176_hi"]):
        done = CliRunner().invoke(cli, ["stability", str(HOME / "designs/check_bogie.yaml"), *words])
        assert done.exit_code == 2, done.output


def test_a_speed_limit_below_the_range_is_found_there() -> None:
    track = "erri_b176_high length=1000 seed=1"
    design = CHECK.with_effects([SLIPPERY, FLANGE])
    low, high = (stability(design, speeds, track=track) for speeds in ([40.0, 60.0], [60.0, 80.0]))
    assert high["practical_critical_speed"] == pytest.approx(low["practical_critical_speed"], abs=0.11)
    assert any("below the range" in note for note in high["notes"])


def test_no_admissible_speed_at_all_is_null_with_its_reason() -> None:
    design = CHECK.with_values({"contact.flange_clearance": 1e-5})
    result = stability(design, [20.0, 40.0], track="erri_b176_high length=200 seed=1")
    assert result["practical_critical_speed"] is None and result["practical"]["decided_by"]
    assert any(note.endswith("not admissible at 5 m/s") for note in result["notes"])
