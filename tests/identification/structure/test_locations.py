"""Locations of effects on a vehicle of bodies: one for all elements that move alike."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui import core
from railui.identification.structure.equivalent_inputs import FORCE_LOCATIONS, force_locations
from railui.identification.structure.locations import (
    candidate_locations,
    distinct_locations,
    estimated_elements,
    joint_key,
    location_of_number,
)
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model

DESIGNS = Path(__file__).parents[3] / "designs"
COACH = Model(load_design(DESIGNS / "manchester_coach.yaml"))
BOGIE = Model(load_design(DESIGNS / "test_bogie.yaml"))
EXPECTED_LOCATIONS = {
    "elements.yaw_damper.damping": "yaw_damper_yaw",  # its direction is longitudinal
    "elements.primary.lateral_stiffness": "primary_lateral",
    "elements.primary.longitudinal_stiffness": "primary_yaw",
    "bodies.frame.mass": "frame",
    "bodies.frame.yaw_inertia": "frame_yaw",
}


def test_elements_between_the_same_bodies_are_one_location() -> None:
    lateral = [at for at in distinct_locations(COACH) if at.endswith("_lateral")]
    assert lateral == ["primary_lateral", "secondary_lateral"]


def test_the_law_of_a_damper_is_sought_at_the_damper() -> None:
    names = [at for at, _ in candidate_locations(COACH, core.effect_record("quadratic_damper"))]
    assert "lateral_damper_lateral" in names and "secondary_lateral" not in names
    names = [at for at, _ in candidate_locations(COACH, core.effect_record("dry_friction"))]
    assert "secondary_lateral" in names and "lateral_damper_lateral" not in names


def test_every_joint_of_a_location_is_a_candidate_after_all_of_them() -> None:
    found = dict(candidate_locations(COACH, core.effect_record("free_play")))
    assert found["primary_lateral"] == (None, 1, 2, 3, 4)
    assert found["secondary_lateral"] == (None, 1, 2)


def test_a_coach_takes_no_further_carbody() -> None:
    assert candidate_locations(COACH, core.effect_record("coach_mode")) == []


def test_forces_are_compared_at_joints_wheelsets_and_bodies() -> None:
    found = {(at, number): ports for at, number, ports in force_locations(COACH)}
    assert len(found["contact", None]) == 8 and len(found["contact", 3]) == 2
    assert found["body", None] == (("body", None),) and ("frame", 2) in found
    assert force_locations(BOGIE) == FORCE_LOCATIONS


@pytest.mark.parametrize("name", ["bogie_under_coach", "manchester_coach", "cooperrider"])
def test_every_estimated_number_of_a_vehicle_has_a_location_of_it(name: str) -> None:
    model = Model(load_design(DESIGNS / f"{name}.yaml"))
    structure = model.design.structure
    assert structure is not None
    paths = [p for p in model.design.values if p.startswith(("vehicle.elements", "vehicle.bodies"))]
    assert paths and {location_of_number(structure, p) for p in paths} <= set(structure.effect_locations)


def test_a_number_is_located_in_its_direction() -> None:
    structure = Model(load_design(DESIGNS / "bogie_under_coach.yaml")).design.structure
    assert structure is not None
    at = {path: location_of_number(structure, f"vehicle.{path}") for path in EXPECTED_LOCATIONS}
    assert at == EXPECTED_LOCATIONS


def test_the_elements_of_one_joint_share_its_key() -> None:
    assert joint_key(COACH, "lateral_damper_lateral") == joint_key(COACH, "secondary_lateral")
    assert joint_key(COACH, "anti_roll_bar_roll") == joint_key(COACH, "secondary_damper_roll")
    assert joint_key(COACH, "secondary_lateral") != joint_key(COACH, "secondary_yaw")
    assert joint_key(BOGIE, "secondary_lateral") != joint_key(BOGIE, "primary_lateral")


def test_an_estimated_number_is_a_spring_or_damper_of_its_joint_only() -> None:
    path = "vehicle.elements.lateral_damper.lateral_damping"
    assert estimated_elements(COACH, [path]) == {("viscous_damper", joint_key(COACH, "secondary_lateral"))}
    turned = estimated_elements(COACH, ["vehicle.elements.primary.longitudinal_stiffness"])
    assert turned == {("spring", joint_key(COACH, "primary_yaw"))}
