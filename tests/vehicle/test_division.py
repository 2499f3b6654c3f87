"""Numbers that differ between the joints of an element or the wheelsets of a contact group."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from jsonschema import Draft202012Validator

from railui.desk.state.design_file import differences
from railui.desk.state.form_rows import Field
from railui.documents.saving import design_text
from railui.documents.schema import json_schema
from railui.io.problems import FileProblems
from railui.io.yaml_edit import edit_values
from railui.optimisation.response_map import paths_of
from railui.report.schematic.equivalent import drawn_topology
from railui.vehicle.design_reader import Design, load_design, parse_design
from railui.vehicle.division import divide_design, divisible_numbers
from railui.vehicle.model import Model

HOME = Path(__file__).parents[2]
COACH = HOME / "designs/manchester_coach.yaml"
TEXT = COACH.read_text("utf-8")
DAMPING, CONICITY = "vehicle.elements.lateral_damper.lateral_damping", "contact.wheels.conicity"
OWN_DAMPERS = """\
    lateral_damper_front: {kind: damper, between: [frame_1, body], y: 1.0, height: 0.8275, lateral_damping: 32e3}
    lateral_damper_rear: {kind: damper, between: [frame_2, body], y: 1.0, height: 0.8275, lateral_damping: 20e3}
"""


def coach(damping: str = "[32 kN*s/m, 20e3]", conicity: str = "[0.1, 0.2, 0.1, 0.1]") -> Design:
    text = TEXT.replace("lateral_damping: 32e3", f"lateral_damping: {damping}")
    return parse_design(text.replace("conicity: 0.1,", f"conicity: {conicity},"))


def eigenvalues(design: Design) -> np.ndarray:
    return Model(design).eigenvalues(40.0)


def test_a_list_gives_each_joint_and_wheelset_its_number() -> None:
    design = coach()
    assert [design.value(f"{DAMPING}.{n}") for n in (1, 2)] == [32e3, 20e3]
    assert [design.value(f"{CONICITY}.{n}") for n in (1, 2, 3, 4)] == [0.1, 0.2, 0.1, 0.1]
    assert design.expand(DAMPING) == [f"{DAMPING}.1", f"{DAMPING}.2"]
    assert design.parameter(f"{DAMPING}.2").unit == "N*s/m"


def test_a_list_acts_as_elements_of_their_own_do() -> None:
    start, end = TEXT.index("    lateral_damper:"), TEXT.index("    anti_roll_bar:")
    own = parse_design(TEXT[:start] + OWN_DAMPERS + TEXT[end:])
    np.testing.assert_allclose(eigenvalues(coach(conicity="0.1")), eigenvalues(own), rtol=1e-9, atol=1e-9)


def test_contact_of_each_wheelset_acts_as_groups_of_their_own_do() -> None:
    start, end = TEXT.index("  wheels: {"), TEXT.index("  spin_creep")
    line = TEXT[start:end]
    groups = [line.replace("wheels", f"wheelset_{n}").replace("0.1,", f"{x},", 1) for n, x in ((1, 0.1), (2, 0.2))]
    groups += [line.replace("wheels", f"wheelset_{n}") for n in (3, 4)]
    own = parse_design(TEXT[:start] + "".join(groups) + TEXT[end:])
    np.testing.assert_allclose(eigenvalues(coach(damping="32e3")), eigenvalues(own), rtol=1e-9, atol=1e-9)


def test_equal_members_are_the_vehicle_with_the_common_number() -> None:
    undivided = load_design(COACH)
    assert undivided.structure is not None
    divided = divide_design(undivided, list(divisible_numbers(undivided.structure)))
    np.testing.assert_array_equal(eigenvalues(divided), eigenvalues(undivided))
    laden = [design.with_values({"load.state": "laden"}) for design in (divided, undivided)]
    np.testing.assert_array_equal(eigenvalues(laden[0]), eigenvalues(laden[1]))


def test_a_divided_design_is_written_and_read_as_it_was() -> None:
    written = design_text(coach())
    assert "lateral_damping: [32000, 20000]" in written
    again = parse_design(written)
    assert again.values == coach().values and again.structure == coach().structure


@pytest.mark.parametrize(
    ("old", "new", "key", "says"),
    [
        ("lateral_damping: 32e3", "lateral_damping: [1e3, 2e3, 3e3]", DAMPING, "has 3 numbers for 2 joints"),
        ("lateral_damping: 32e3", "lateral_damping: [1e3, 2 m]", f"{DAMPING}.1", "unit m"),
        ("lateral_damping: 32e3", "lateral_damping: []", DAMPING, "is empty"),
        ("conicity: 0.1,", "conicity: [0.1, 0.2],", CONICITY, "has 2 numbers for 4 wheelsets"),
        ("gap: 25 mm", "gap: 25 mm\n      x: [1, 2]", "vehicle.elements.bump_stop.x", "a list is not a quantity"),
        ("mass: 32000", "mass: [32000, 1]", "vehicle.bodies.body.mass", "a list is not a quantity"),
    ],
)
def test_a_wrong_list_is_reported_with_its_place(old: str, new: str, key: str, says: str) -> None:
    text = TEXT.replace(old, new, 1)
    with pytest.raises(FileProblems) as caught:
        parse_design(text, "coach.yaml")
    (problem,) = caught.value.problems
    assert says in problem.message and problem.remedy and problem.line and problem.key == key


def test_an_element_with_one_joint_takes_no_list() -> None:
    text = TEXT.replace(
        "between: [frame, body]\n      stiffness: 940e3", "between: [frame_1, body]\n      stiffness: [1, 2]"
    )
    with pytest.raises(FileProblems, match="acts at one of the joints only"):
        parse_design(text)


def test_contact_with_profiles_takes_no_list() -> None:
    profiles = f"  profiles: {{wheel: {HOME}/designs/profiles/s1002.txt, rail: {HOME}/designs/profiles/60e1.txt}}\n"
    text = TEXT.replace("conicity: 0.1,", "conicity: [0.1, 0.2, 0.1, 0.1],").replace(
        "contact: ", f"contact:\n{profiles}#", 1
    )
    with pytest.raises(FileProblems, match="have the same contact parameters"):
        parse_design(text)


def test_a_number_of_one_joint_is_an_override_and_edits_its_place_in_the_list() -> None:
    text = TEXT.replace("lateral_damping: 32e3", "lateral_damping: [32 kN*s/m, 20 kN*s/m]")
    saved = parse_design(text)
    changed = saved.with_values({f"{DAMPING}.2": "25 kN*s/m"})
    edited = edit_values(text, differences(changed, saved))
    assert "lateral_damping: [32 kN*s/m, 25 kN*s/m]" in edited and parse_design(edited).values == changed.values


def test_a_divided_vehicle_is_drawn_as_the_undivided_one() -> None:
    equal = coach("[32e3, 32e3]", "[0.1, 0.1, 0.1, 0.1]")
    assert drawn_topology(equal)[1].items() >= load_design(COACH).values.items()


def test_an_override_without_a_number_sets_all_joints() -> None:
    changed = coach().with_values({DAMPING: "30 kN*s/m"})
    assert [changed.value(f"{DAMPING}.{n}") for n in (1, 2)] == [30e3, 30e3]
    assert paths_of(coach(), DAMPING) == [f"{DAMPING}.1", f"{DAMPING}.2"]


def test_the_form_names_a_number_of_one_joint_with_its_group() -> None:
    field = Field(f"{DAMPING}.2", "c", "", "N*s/m", 2e4)
    assert (field.name, field.group) == ("lateral damping 2", "vehicle.elements.lateral_damper")


@pytest.mark.parametrize(("value", "valid"), [([32e3, "20 kN*s/m"], True), ([32e3], False), ({"a": 1}, False)])
def test_the_schema_takes_a_number_or_a_list(value: Any, valid: bool) -> None:
    data = yaml.safe_load(TEXT)
    data["vehicle"]["elements"]["lateral_damper"]["lateral_damping"] = value
    assert (not list(Draft202012Validator(json_schema("design")).iter_errors(data))) == valid
