"""Effects in files: kind, location, wheelset and numbers, checked against the catalogue."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from railui import core
from railui.io.problems import Problem
from railui.io.units import parse_unit
from railui.vehicle.design_reader import Design, PlacedEffect, parse_design
from railui.vehicle.effects import default_at, range_at, unit_at

ProblemsOf = Callable[[Callable[[], object]], list[Problem]]
Records = list[dict[str, Any]]


@pytest.fixture
def with_effects(bogie: str, catalogue: Records) -> Callable[[str], Design]:
    """Reads the bogie with a list of effects."""
    return lambda effects: parse_design(f"{bogie}effects:\n{effects}", catalogue=catalogue)


@pytest.mark.parametrize(
    ("word", "at", "unit"),
    [
        ("z", "primary_lateral", "m"),
        ("z", "primary_yaw", "rad"),
        ("v", "secondary_yaw", "rad/s"),
        ("F", "frame_yaw", "N*m"),
        ("F/z", "secondary_lateral", "N/m"),
        ("F/z", "secondary_yaw", "N*m/rad"),
        ("F*s/z", "primary_lateral", "N*s/m"),
        ("F*s/z", "primary_yaw", "N*m*s/rad"),
        ("F/z^3", "primary_lateral", "N/m^3"),
        ("F*s^2/z^2", "primary_lateral", "N*s^2/m^2"),
        ("F/v", "primary_lateral", "N*s/m"),
        ("N*s/m", "track", "N*s/m"),
        ("1/m^2", "contact", "1/m^2"),
        ("kg", "secondary_lateral", "kg"),
        ("z", "ay1", "m/s^2"),
        ("z", "rf", "rad/s"),
        ("F/z", "rig", "1"),
        ("1", "contact", "1"),
    ],
)
def test_a_unit_product_becomes_the_unit_of_its_location(word: str, at: str, unit: str) -> None:
    assert unit_at(word, at) == unit
    parse_unit(unit)


def test_numbers_are_si_whatever_their_unit(with_effects: Callable[[str], Design]) -> None:
    design = with_effects(
        "  - {kind: free_play, at: primary_yaw, half_width: 0.3 mrad}\n"
        "  - {kind: quadratic_damper, at: secondary_yaw, damping: 2 kN*m*s^2/rad^2}\n"
        "  - {kind: maxwell_damper, at: secondary_lateral, stiffness: 5 MN/m, damping: 20 kN*s/m,"
        " blow_off: 8 kN}\n"
    )
    assert [dict(e.parameters) for e in design.effects] == [
        {"half_width": 0.3e-3},
        {"damping": 2e3},
        {"stiffness": 5e6, "damping": 2e4, "blow_off": 8e3},
    ]
    assert design.unit("effects.2.blow_off") == "N"


def test_a_parameter_left_out_is_a_multiple_of_the_declared_spring(
    with_effects: Callable[[str], Design],
) -> None:
    design = with_effects("  - {kind: spring, at: primary_lateral}\n  - {kind: maxwell_damper, at: secondary_yaw}\n")
    assert design.effects[0].parameters == {"stiffness": 2 * 3e6}
    assert design.effects[1].parameters == {
        "stiffness": 2e5,
        "damping": 2e4,
    }  # the optional blow-off stays off


def test_the_only_possible_location_may_be_omitted(with_effects: Callable[[str], Design]) -> None:
    assert with_effects("  - {kind: creep_saturation}\n").effects[0].at == "contact"


def test_the_flange_clearance_is_one_number(with_effects: Callable[[str], Design]) -> None:
    design = with_effects("  - {kind: flange_contact}\n")
    assert design.value("effects.0.clearance") == 0.007
    assert design.with_values({"contact.flange_clearance": "9 mm"}).value("effects.0.clearance") == 0.009
    given = with_effects("  - {kind: flange_contact, clearance: 8 mm}\n")
    assert given.with_values({"contact.flange_clearance": "9 mm"}).value("effects.0.clearance") == 0.008


def test_every_fault_of_effects_is_reported_with_its_path(
    with_effects: Callable[[str], Design], problems_of: ProblemsOf
) -> None:
    found = problems_of(
        lambda: with_effects(
            "  - {kind: freeplay, at: primary_lateral}\n"
            "  - {kind: free_play, at: primary, wheelset: 3}\n"
            "  - {kind: free_play, at: primary_yaw, wheelset: 3, half_widht: 3, half_width: 3 mm}\n"
            "  - {kind: spring, at: secondary_lateral, wheelset: 1, stiffness: -1}\n"
            "  - {at: contact}\n"
            "  - {kind: creep_saturation, friction: 35}\n"
            "  - {kind: sensor_gain, at: e1}\n"
            "  - {kind: free_play, at: rig}\n"
            "  - 3\n"
        )
    )
    assert [(p.line, p.column, p.key) for p in found] == [
        (14, 12, "effects.0.kind"),
        (15, 27, "effects.1.at"),
        (16, 50, "effects.2.wheelset"),
        (16, 53, "effects.2.half_widht"),
        (16, 80, "effects.2.half_width"),
        (17, 53, "effects.3.wheelset"),
        (17, 67, "effects.3.stiffness"),
        (18, 5, "effects.4"),
        (19, 40, "effects.5.friction"),
        (20, 12, "effects.6.kind"),
        (21, 27, "effects.7.at"),
        (22, 5, "effects.8"),
    ]
    assert "did you mean 'free_play'?" in found[0].remedy
    assert "did you mean 'half_width'?" in found[3].remedy
    assert "0.01 to 1" in found[8].remedy
    assert "campaign" in found[9].remedy


def test_effects_that_supersede_the_same_term_are_both_named(
    with_effects: Callable[[str], Design], problems_of: ProblemsOf
) -> None:
    play = "  - {kind: free_play, at: secondary_lateral}\n"
    found = problems_of(lambda: with_effects(play + "  - {kind: coach_mode}\n"))
    assert found[0].key == "effects.1"
    assert "coach_mode and free_play (effects.0) both supersede the linear stiffness" in found[0].message


def test_the_same_law_on_either_wheelset_is_no_conflict(
    with_effects: Callable[[str], Design], problems_of: ProblemsOf
) -> None:
    one = "  - {kind: free_play, at: primary_lateral, wheelset: 1}\n"
    two = one.replace("1}", "2}")
    assert len(with_effects(one + two).effects) == 2
    assert len(problems_of(lambda: with_effects(one + two.replace(", wheelset: 2", "")))) == 1


def test_the_abscissa_of_a_curve_is_motion_speed_or_distance(
    with_effects: Callable[[str], Design], problems_of: ProblemsOf
) -> None:
    curve = "  - {{kind: measured_force, at: primary_lateral, against: {0}, motion: [{1}], force: [-2 kN, 0, 2 kN]}}\n"
    effect = with_effects(curve.format("v", "-10 mm/s, 0, 10 mm/s")).effects[0]
    assert effect.against == "v"
    assert effect.parameters == {"motion": (-0.01, 0.0, 0.01), "force": (-2e3, 0.0, 2e3)}
    assert hash(effect) == hash(PlacedEffect(effect.kind, effect.at, None, effect.parameters, "v"))
    assert "does not rise" in problems_of(lambda: with_effects(curve.format("z", "0, 0, 1")))[0].message
    assert "has 3 values, motion has 2" in problems_of(lambda: with_effects(curve.format("z", "0, 1")))[0].message
    assert "unit mm/s" in problems_of(lambda: with_effects(curve.format("z", "0, 1 mm/s, 2")))[0].message
    assert problems_of(lambda: with_effects(curve.format("x", "0, 1, 2")))[0].key == "effects.0.against"


def test_at_a_rig_numbers_are_in_the_units_of_the_run(catalogue: Records, problems_of: ProblemsOf) -> None:
    text = "vehicle: {rig: {mass: 1, stiffness: 4}}\neffects: [{kind: free_play, at: rig, half_width: %s}]\n"
    assert parse_design(text % 0.2, catalogue=catalogue).value("effects.0.half_width") == 0.2
    assert parse_design(text % "0.3 mm", catalogue=catalogue).value("effects.0.half_width") == 0.3e-3
    # 5 mm mean nothing there, so there is no default
    assert "no default" in problems_of(lambda: parse_design(text % "", catalogue=catalogue))[0].message


def test_effects_added_by_a_program_are_checked_too(bogie: str, catalogue: Records, problems_of: ProblemsOf) -> None:
    design = parse_design(bogie, catalogue=catalogue)
    play = PlacedEffect("free_play", "primary_lateral", 2, {"half_width": 4e-4})
    assert design.with_effects([play]).effects == (play,)
    assert problems_of(lambda: design.with_effects([play, play]))[0].key == "effects.1"
    assert (
        design.with_effects([play]).with_values({"effects.0.half_width": "0.5 mm"}).value("effects.0.half_width")
        == 5e-4
    )


def test_the_record_of_an_effect_has_unit_and_range(with_effects: Callable[[str], Design]) -> None:
    design = with_effects("  - {kind: gauge_conicity}\n  - {kind: spring, at: primary_lateral}\n")
    gauge, spring = design.parameter("effects.0.per_gauge"), design.parameter("effects.1.stiffness")
    assert (gauge.unit, gauge.minimum, gauge.maximum) == ("1/m", -100.0, 100.0)
    assert (spring.unit, spring.maximum) == ("N/m", 100 * 6e6)
    assert design.expand("effects") == ["effects.0.per_gauge", "effects.1.stiffness"]


def test_every_effect_of_the_kernel_fits_the_files(bogie: str) -> None:
    values = parse_design(bogie).values
    for record in core.effect_catalogue():
        for at in record["at"]:
            for parameter in record["parameters"]:
                parse_unit(unit_at(parameter["unit"], at))
                default, (low, high) = default_at(parameter, at, values), range_at(parameter, at, values)
                assert low <= high
                assert default is None or low <= default <= high, (record["kind"], at, parameter["key"])
