"""Multibody vehicles in files: positions of faults, paths of numbers."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.documents.saving import design_text
from railui.io.problems import FileProblems, Problem
from railui.vehicle.design_reader import Design, load_design, parse_design

HOME = Path(__file__).parents[2]
TEXT = (HOME / "designs/cooperrider.yaml").read_text("utf-8")


def problems_of(text: str) -> tuple[Problem, ...]:
    with pytest.raises(FileProblems) as caught:
        parse_design(text, "bogie.yaml")
    return caught.value.problems


def changed(old: str, new: str) -> str:
    assert old in TEXT
    return TEXT.replace(old, new, 1)


def bogie() -> Design:
    return load_design(HOME / "designs/cooperrider.yaml")


ELEMENTS = "vehicle.elements"


@pytest.mark.parametrize(
    ("old", "new", "key", "says"),
    [
        ("between: [wheelset, frame]", "between: [wheelset, fram]", f"{ELEMENTS}.primary.between.1", "no body 'fram'"),
        ("      under: frame\n", "      under: bogie\n", f"{ELEMENTS}.wheelset.under", "no body 'bogie'"),
        ("kind: damper", "kind: dampr", f"{ELEMENTS}.secondary_damper.kind", "unknown kind 'dampr'"),
        ("kind: damper", "height_to: 1\n      kind: damper", f"{ELEMENTS}.secondary_damper.height_to", "unknown key"),
        ("      mass: 2918 ", "      #", "vehicle.bodies.frame.mass", "is missing"),
        ("mass: 1022", "mass: 1022 m", f"{ELEMENTS}.wheelset.mass", "unit m"),
        ("contact:\n  wheels:", "contact:\n  whels: 5\n  wheels:", "contact.whels", "unknown key"),
        ("[frame, ground]\n      y", "[frame]\n      y", f"{ELEMENTS}.secondary.between", "not a pair"),
        ("at: contact, friction", "at: primary_vertical, friction", "effects.0.at", "not possible"),
    ],
)
def test_a_fault_is_reported_with_its_path(old: str, new: str, key: str, says: str) -> None:
    found = problems_of(changed(old, new))
    assert [p.key for p in found] == [key] and says in found[0].message + found[0].remedy, found
    assert found[0].line > 1 and found[0].column > 1


def test_a_spring_without_stiffness_is_reported() -> None:
    found = problems_of(changed("yaw_stiffness: 2.710e6", "#"))
    assert found[0].key == "vehicle.elements.pivot" and "has no stiffness" in found[0].message


def test_all_faults_are_reported_together() -> None:
    text = changed("mass: 1022", "mass: -1").replace("kind: damper", "kind: dampr")
    assert len(problems_of(text)) >= 3


def test_every_number_is_an_override() -> None:
    design = bogie()
    for path in design.values:
        assert design.with_values({path: 1.01 * design.value(path) + 1e-4}).value(path) != design.value(path), path
        assert design.parameter(path).path == path


def test_a_group_of_paths_expands_to_its_numbers() -> None:
    found = bogie().expand("vehicle.elements.primary")
    assert "vehicle.elements.primary.lateral_stiffness" in found and len(found) == 8


def test_an_unknown_override_names_the_nearest() -> None:
    with pytest.raises(FileProblems, match="lateral_stiffness"):
        bogie().with_values({"vehicle.elements.primary.latral_stiffness": 1e6})


def test_an_effect_at_an_element_takes_its_default_from_that_element() -> None:
    text = TEXT + "  - {kind: bump_stop, at: secondary_lateral}\n"
    design = parse_design(text)
    assert design.value("effects.2.stiffness") == pytest.approx(3 * 2 * 1.823e5)
    softer = design.with_values({"vehicle.elements.secondary.lateral_stiffness": 1e5})
    assert softer.value("effects.2.stiffness") == pytest.approx(3 * 2 * 1e5)


def test_an_unknown_number_of_a_location_is_reported() -> None:
    found = problems_of(TEXT + "  - {kind: free_play, at: primary_lateral, wheelset: 3, half_width: 1 mm}\n")
    assert found[0].key == "effects.2.wheelset" and "1, 2" in found[0].remedy


LOAD = """
load:
  tare: {}
  laden: {vehicle.bodies.frame.mass: 4 t, vehicle.elements.wheelset.wheel_load: 70 kN}
"""


def test_a_load_state_changes_its_values_and_tare_restores_them() -> None:
    design = parse_design(TEXT + LOAD)
    laden = design.with_values({"load.state": "laden", "vehicle.elements.wheelset.mass": 1100})
    assert laden.value("vehicle.bodies.frame.mass") == 4000 and laden.load_state == "laden"
    tare = laden.with_values({"load.state": "tare"})
    assert tare.value("vehicle.bodies.frame.mass") == 2918 and tare.value("vehicle.elements.wheelset.mass") == 1100


def test_a_file_may_select_a_load_state() -> None:
    design = parse_design(TEXT + LOAD.replace("load:\n", "load:\n  state: laden\n"))
    assert design.value("vehicle.bodies.frame.mass") == 4000


def test_unknown_load_states_and_unknown_paths_in_them_are_reported() -> None:
    found = problems_of(TEXT + "load: {state: empty, laden: {vehicle.bodies.frame.mas: 4 t}}\n")
    assert {p.key for p in found} == {"load.state", "load.laden.vehicle.bodies.frame.mas"}
    with pytest.raises(FileProblems, match="laden"):
        parse_design(TEXT + LOAD).with_values({"load.state": "ladn"})


@pytest.mark.parametrize("name", ["cooperrider", "bogie_under_coach", "manchester_coach"])
def test_a_written_design_is_read_as_it_was(name: str) -> None:
    design = load_design(HOME / f"designs/{name}.yaml")
    found = parse_design(design_text(design))
    assert found.values == design.values and found.effects == design.effects and found.load_states == design.load_states
    assert found.structure == design.structure


def test_a_laden_design_is_written_laden_and_can_be_unloaded() -> None:
    tare = load_design(HOME / "designs/manchester_coach.yaml")
    found = parse_design(design_text(tare.with_values({"load.state": "laden"})))
    assert found.load_state == "laden" and found.value("vehicle.bodies.body.mass") == 38000
    assert found.with_values({"load.state": "tare"}).values == tare.values


def test_too_many_bodies_are_rejected_before_they_are_joined() -> None:
    crowd = "".join(f"    body_{i}: {{mass: 1000, yaw_inertia: 500}}\n" for i in range(3000))
    (problem,) = problems_of(changed("  bodies:\n", f"  bodies:\n{crowd}"))
    assert problem.key == "vehicle" and "6007 degrees of freedom, at most 32" in str(problem)


def test_too_many_wheelsets_are_rejected() -> None:
    one = "kind: wheelset, mass: 1022, yaw_inertia: 678, half_gauge: 0.7163, rolling_radius: 0.4572, wheel_load: 66 kN"
    more = "".join(f"    axle_{i}: {{{one}, x: {-i}}}\n" for i in range(11))
    (problem,) = problems_of(changed("  elements:\n", f"  elements:\n{more}"))
    assert problem.key == "vehicle" and "13 wheelsets, at most 12" in str(problem)
