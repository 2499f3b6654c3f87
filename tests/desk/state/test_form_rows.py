"""Fields of a form: sliders over decades, typed numbers in the shown unit, warnings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from railui.desk.state.draft import Draft
from railui.desk.state.form_rows import (
    Field,
    range_text,
    speed_field,
    typed_preview,
    typed_speed_unit,
    value_text,
    warning_text,
)
from railui.vehicle.effects import PlacedEffect
from tests.desk.conftest import REPOSITORY


def field(draft: Draft, path: str) -> Field:
    """Return the field of a path."""
    return next(f for f in draft.fields() if f.path == path)


@pytest.mark.parametrize(
    ("path", "text", "value"),
    [
        ("vehicle.secondary.yaw_damping", "80", 80e3),  # shown in kN·m·s/rad
        ("vehicle.secondary.yaw_damping", "80 N*m*s/rad", 80.0),
        ("vehicle.primary.lateral_stiffness", "2.5", 2.5e6),
        ("vehicle.primary.lateral_stiffness", "1e1", 1e7),
        ("vehicle.frame.mass", "3000", 3000.0),
        ("contact.flange_clearance", "6", 6e-3),
        ("contact.leading.conicity", "0.2", 0.2),
        ("riding.journey", "3", 3 * 3600.0),
    ],
)
def test_a_typed_number_is_in_the_unit_that_is_shown(bogie: Path, path: str, text: str, value: float) -> None:
    draft = Draft.load(bogie)
    draft.set(path, field(draft, path).typed(text))
    assert draft.design.value(path) == value


def test_a_zero_is_shown_and_typed_with_the_prefix_of_its_slider(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.secondary.lateral_stiffness", 0.0)
    zero = field(draft, "vehicle.secondary.lateral_stiffness")
    assert value_text(zero) == "0 kN/m" and zero.typed("200") == "200 kN/m"


@pytest.mark.parametrize("name", ["test_bogie.yaml", "bogie_under_coach.yaml", "manchester_coach.yaml"])
def test_every_slider_moves_by_small_steps_both_ways(name: str) -> None:
    draft = Draft.load(REPOSITORY / "designs" / name)
    for f in draft.fields():
        if f.choices or not isinstance(f.value, int | float) or not f.value:
            continue
        up, down = f.stepped(1), f.stepped(-1)
        assert f.value < up or f.value == f.high, f.path
        assert down < f.value or f.value == f.low, f.path
        if f.unit.startswith("N"):  # springs and dampers: by 3 to 30 %, whatever their size
            assert up <= 1.3 * f.value and (down >= 0.7 * f.value or down == 0.0), f.path


@pytest.mark.parametrize("path", ["lateral_stiffness", "yaw_stiffness", "lateral_damping", "yaw_damping"])
def test_a_slider_from_zero_spans_decades_and_reaches_zero(bogie: Path, path: str) -> None:
    f = field(Draft.load(bogie), f"vehicle.secondary.{path}")
    assert f.is_logarithmic and 0.2 < f.position(float(f.value or 0.0)) < 0.9
    assert f.value_at(0.0) == 0.0 and f.value_at(1.0) == f.high
    assert f.value_at(f.position(float(f.value or 0.0))) == f.value


def test_the_slider_of_a_clearance_is_logarithmic(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.add_effect(PlacedEffect("free_play", "primary_lateral", None, {"half_width": 3e-4}))
    f = field(draft, "effects.0.half_width")
    assert f.is_logarithmic and 0.1 < f.position(3e-4) < 0.9
    assert 3e-4 < f.stepped(1) < 4e-4


@pytest.mark.parametrize(("value", "is_unusual"), [("200 MN/m", True), ("1e-8 N/m", True), ("5 MN/m", False)])
def test_a_value_outside_the_usual_range_is_warned_of(bogie: Path, value: str, is_unusual: bool) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.primary.lateral_stiffness", value)
    f = field(draft, "vehicle.primary.lateral_stiffness")
    assert bool(warning_text(f)) == f.is_unusual == is_unusual
    assert (f.low, f.high) == (1e5, 1e8)  # the slider does not grow
    preview, is_rejected = typed_preview(f, value)
    assert ("outside the usual 100 kN/m to 100 MN/m" in preview) == is_unusual and not is_rejected


def test_a_value_beyond_its_slider_steps_back_to_the_end_and_not_farther(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.primary.lateral_stiffness", "200 MN/m")
    f = field(draft, "vehicle.primary.lateral_stiffness")
    assert f.stepped(1) == 2e8 and f.stepped(-1) == 1e8


def test_a_preview_shows_what_will_be_read_and_why_not(bogie: Path) -> None:
    f = field(Draft.load(bogie), "vehicle.primary.lateral_stiffness")
    assert typed_preview(f, "5") == ("= 5 MN/m", False)
    text, is_rejected = typed_preview(f, "5 kg")
    assert is_rejected and "N/m" in text
    text, is_rejected = typed_preview(f, "3,5 MN/m")
    assert is_rejected and "3.5 MN/m" in text
    assert typed_preview(f, "") == ("in MN/m, or with another unit", False)


def test_whole_numbers_step_by_one_at_least() -> None:
    generations = Field("generations", "", "", "1", 1, 1, 200, is_integer=True)
    assert generations.stepped(1) == 2 and generations.stepped(-1) == 1
    population = Field("population", "", "", "1", 64, 8, 512, is_integer=True)
    assert isinstance(population.stepped(1), int) and population.stepped(1) > 64


def test_a_speed_is_read_and_shown_in_the_unit_typed_last() -> None:
    field = speed_field("speed", 40.0, typed_speed_unit("144 km/h"))
    assert value_text(field) == "144 km/h" and field.shown_unit == "km/h"
    assert field.typed("160") == "160 km/h" and field.typed("50 m/s") == "50 m/s"
    assert typed_preview(field, "160")[0] == "= 160 km/h"
    assert range_text(field) == "18 km/h to 360 km/h · 40 m/s"
    assert range_text(speed_field("speed", 40.0, "m/s")) == "5 m/s to 100 m/s · 144 km/h"
    assert typed_speed_unit("0.5 km") == "" and typed_speed_unit(40.0) == ""


def test_range_and_warning_name_the_same_ends() -> None:
    """The slider ends two decades about the base; the usual range is that of real vehicles."""
    field = Field("frame.yaw_inertia", "", "yaw inertia", "kg*m^2", 50.0, 35.0, 350e3, usual=(100.0, 5e6))
    assert range_text(field) in warning_text(field)
    assert range_text(replace(field, usual=None)) == "35 kg·m² to 350000 kg·m²"
