"""Design files: numbers by dotted path, defaults, overrides, positions of faults."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from railui.documents.saving import design_text
from railui.io.problems import FileProblems, Problem
from railui.io.units import UnitError, parse_unit
from railui.io.yaml_document import parse_yaml
from railui.vehicle.design_reader import Design, PlacedEffect, load_design, parse_design
from railui.vehicle.element_kinds import BODY, DIRECTIONS, ELEMENT_KINDS, parameters_of_kind
from railui.vehicle.parameter import Inclination, Parameter
from railui.vehicle.parameters import BENCH_PARAMETERS, DEFAULT_ESTIMATED, FORMS, PARAMETERS

ProblemsOf = Callable[[Callable[[], object]], list[Problem]]
Records = list[dict[str, Any]]


def test_quantities_are_in_si_by_dotted_path(bogie: str) -> None:
    design = parse_design(bogie)
    assert design.kind == "bogie"
    assert design.values["vehicle.wheel_load"] == 55e3
    assert design.values["vehicle.primary.longitudinal_stiffness"] == 8e6
    assert design.values["vehicle.secondary.yaw_stiffness"] == 2e5
    assert design.value("contact.flange_clearance") == 0.007
    assert list(design.values) == [p.path for p in FORMS["bogie"]]


def test_an_absent_key_takes_its_default(bogie: str) -> None:
    design = parse_design(bogie)
    assert design.value("vehicle.secondary.yaw_damping") == 0.0
    assert design.value("contact.spin_creep") == 0.25
    assert design.value("contact.trailing.roll") == 0.05
    assert design.gauge_widens_clearance is False


def test_a_design_with_effects_loads(bogie: str, catalogue: Records) -> None:
    text = bogie + (
        "effects:\n  - {kind: free_play, at: primary_lateral, wheelset: 2, half_width: 0.3 mm}\n"
        "riding: {use: long_distance, journey: 4 h, comfort_weight: 0.6, admissible_flange_fraction: 0.05,"
        " floor_frequency: 1.2 Hz, floor_damping: 0.2}\n"
    )
    design = parse_design(text, catalogue=catalogue)
    assert design.effects == (PlacedEffect("free_play", "primary_lateral", 2, {"half_width": 0.3e-3}),)
    assert design.riding == parse_design(bogie).riding


@pytest.mark.parametrize(("use", "journey", "weight"), [("long_distance", 14400.0, 0.6), ("local", 3600.0, 0.4)])
def test_riding_defaults_depend_on_the_use(bogie: str, use: str, journey: float, weight: float) -> None:
    riding = parse_design(f"{bogie}riding: {{use: {use}}}\n").riding
    assert (riding.journey, riding.comfort_weight) == (journey, weight)
    assert (riding.admissible_flange_fraction, riding.floor_frequency, riding.floor_damping) == (
        0.05,
        1.2,
        0.2,
    )
    assert riding.cushion_frequency is None


def test_a_seat_cushion_requires_frequency_and_damping(bogie: str, problems_of: ProblemsOf) -> None:
    found = problems_of(lambda: parse_design(f"{bogie}riding: {{cushion_frequency: 4 Hz}}\n"))
    assert [p.key for p in found] == ["riding"]


def test_several_faults_are_reported_together_with_positions(bogie: str, problems_of: ProblemsOf) -> None:
    text = (
        bogie.replace("mass: 2900", "mas: 2900")
        .replace("8 MN/m", "8 MN")
        .replace("conicity: 0.15", "conicity: wide", 1)
        .replace("55 kN", "-55 kN")
    )
    found = problems_of(lambda: parse_design(text + "tyres: 4\n", "b.yaml"))
    assert [(p.line, p.column, p.key) for p in found] == [
        (3, 14, "vehicle.frame.mass"),
        (3, 15, "vehicle.frame.mas"),
        (6, 15, "vehicle.wheel_load"),
        (7, 68, "vehicle.primary.longitudinal_stiffness"),
        (10, 24, "contact.leading.conicity"),
        (13, 1, "tyres"),
    ]
    lines = str(FileProblems(found)).splitlines()
    assert lines[1] == "b.yaml:3:15: vehicle.frame.mas: unknown key, did you mean 'mass'?"
    assert "a unit like N/m is expected, write for example '3.0 MN/m'" in lines[3]


def test_a_key_at_the_wrong_level_is_reported_with_its_path(bogie: str, problems_of: ProblemsOf) -> None:
    assert "contact.leading.conicity" in problems_of(lambda: parse_design(bogie + "conicity: 0.1\n"))[0].remedy


def test_a_yaml_1_1_merge_key_is_rejected_with_the_remedy(bogie: str, problems_of: ProblemsOf) -> None:
    text = bogie.replace("  leading:  {", "  leading: &l {").replace("  trailing: {", "  trailing: {<<: *l, ")
    assert "merge keys" in problems_of(lambda: parse_design(text))[0].remedy


@pytest.mark.parametrize("path", [p.path for p in FORMS["bogie"]])
def test_a_missing_number_is_reported_or_has_a_default(bogie: str, path: str, problems_of: ProblemsOf) -> None:
    data = parse_yaml(bogie).value
    *groups, key = path.split(".")
    here = data
    for group in groups:
        here = here[group]
    here.pop(key, None)
    text = json.dumps(data)
    if PARAMETERS[path].default is None:
        assert [p.key for p in problems_of(lambda: parse_design(text))] == [path]
    else:
        assert parse_design(text).value(path) == PARAMETERS[path].default


@pytest.mark.parametrize("mass", ["0", "-1", "0 kg"])
def test_masses_must_be_positive(bogie: str, mass: str, problems_of: ProblemsOf) -> None:
    found = problems_of(lambda: parse_design(bogie.replace("mass: 2900", f"mass: {mass}")))
    assert "too small for the mass of the bogie frame" in found[0].message


def test_a_stiffness_may_be_zero_but_not_negative(bogie: str, problems_of: ProblemsOf) -> None:
    assert parse_design(bogie.replace("3.0 MN/m", "0")).value("vehicle.primary.lateral_stiffness") == 0
    assert len(problems_of(lambda: parse_design(bogie.replace("3.0 MN/m", "-1 N/m")))) == 1


@pytest.mark.parametrize("key", ["bodies", "elements"])
def test_bodies_and_elements_must_be_groups_of_names(key: str, problems_of: ProblemsOf) -> None:
    found = problems_of(lambda: parse_design(f"vehicle: {{{key}: []}}"))
    assert "not a group of names" in found[0].message and found[0].key == f"vehicle.{key}"


def test_a_newer_schema_is_rejected_and_a_missing_one_accepted(bogie: str, problems_of: ProblemsOf) -> None:
    assert parse_design("schema: railui.design/1\n" + bogie).name == "test bogie"
    assert "newer" in problems_of(lambda: parse_design("schema: railui.design/2\n" + bogie))[0].message
    assert (
        "not the schema of a design" in problems_of(lambda: parse_design("schema: railui.study/1\n" + bogie))[0].message
    )


# wheel loads and masses


def test_a_bogie_with_an_unknown_coach_gives_no_warning(bogie: str) -> None:
    assert parse_design(bogie).warnings == ()


def test_wheel_loads_below_the_weight_of_the_bogie_give_a_warning(bogie: str) -> None:
    (warning,) = parse_design(bogie.replace("55 kN", "14 kN")).warnings
    assert (warning.line, warning.column, warning.severity) == (6, 15, "warning")
    assert "4 x wheel load is 56 kN" in warning.message and "64.75 kN" in warning.message
    assert parse_design(bogie.replace("55 kN", "15 kN")).warnings == ()  # within 10 %


@pytest.mark.parametrize(("mass", "warned"), [("15.8 t", False), ("10 t", True), ("25 t", True)])
def test_with_a_declared_coach_the_balance_goes_both_ways(
    bogie: str, catalogue: Records, mass: str, warned: bool
) -> None:
    text = f"{bogie}effects: [{{kind: coach_mode, mass: {mass}}}]\n"
    assert bool(parse_design(text, catalogue=catalogue).warnings) is warned


# rigs


def test_a_rig_is_one_mass_with_its_defaults() -> None:
    rig = parse_design("vehicle: {rig: {mass: 95 kg, stiffness: 0, input: base_acceleration}}")
    assert rig.kind == "rig" and rig.rig_input == "base_acceleration"
    assert dict(rig.values) == {
        "vehicle.rig.mass": 95.0,
        "vehicle.rig.stiffness": 0.0,
        "vehicle.rig.damping": 0.0,
        "vehicle.rig.gain": 1.0,
        "vehicle.rig.preload": 0.0,
    }


def test_a_rig_has_no_contact_and_no_frame(problems_of: ProblemsOf) -> None:
    text = "vehicle: {rig: {mass: 1, input: forse}, frame: {mass: 2}}\ncontact: {}\n"
    found = problems_of(lambda: parse_design(text))
    assert [p.key for p in found] == ["vehicle.rig.input", "vehicle.frame", "contact"]
    assert found[0].remedy == "did you mean 'force'?"


# paths and overrides


def test_a_path_may_name_a_group(bogie: str) -> None:
    design = parse_design(bogie)
    assert len(design.expand("contact.leading")) == 6
    assert design.expand("contact.spin_creep") == ["contact.spin_creep"]
    assert len([p for name in DEFAULT_ESTIMATED["bogie"] for p in design.expand(name)]) == 17


def test_an_unknown_path_names_the_nearest(bogie: str, problems_of: ProblemsOf) -> None:
    design = parse_design(bogie)
    assert "contact.leading" in problems_of(lambda: design.expand("contact.leadin"))[0].remedy
    assert "contact.leading.conicity" in problems_of(lambda: design.value("contact.leading.conicty"))[0].remedy
    assert "contact.leading.conicity" in problems_of(lambda: design.with_values({"conicity": 1}))[0].remedy
    assert "group of 6" in problems_of(lambda: design.with_values({"contact.leading": 1}))[0].message


def test_overrides_are_checked_and_leave_the_original_alone(bogie: str, problems_of: ProblemsOf) -> None:
    design = parse_design(bogie)
    changed = design.with_values(
        {"vehicle.primary.lateral_stiffness": "4 kN/m", "riding.use": "local", "riding.journey": "2 h"}
    )
    assert changed.value("vehicle.primary.lateral_stiffness") == 4000.0
    assert (changed.riding.journey, changed.riding.comfort_weight) == (7200.0, 0.4)
    assert design.value("vehicle.primary.lateral_stiffness") == 3e6
    wrong = {"vehicle.primary.lateral_stiffness": "4 kN", "riding.use": "fast", "vehicle.frame.mass": -1}
    assert sorted(p.key for p in problems_of(lambda: design.with_values(wrong))) == sorted(wrong)


def test_every_parameter_has_unit_symbol_and_caption(bogie: str) -> None:
    design = parse_design(bogie)
    assert design.unit("vehicle.secondary.yaw_damping") == "N*m*s/rad"
    assert design.unit("riding.journey") == "s"
    for path, p in PARAMETERS.items():
        parse_unit(p.unit)
        assert p.symbol and p.caption and p.path == path
        assert p.usual_range[0] <= p.usual_range[1] and p.minimum < p.maximum
        assert p.default is None or p.read(p.default) == p.default


@pytest.mark.parametrize(
    "parameters",
    [BENCH_PARAMETERS.values(), BODY, *(parameters_of_kind(kind, way) for kind in ELEMENT_KINDS for way in DIRECTIONS)],
)
def test_the_example_of_a_parameter_is_one_of_real_vehicles(parameters: Iterable[Parameter]) -> None:
    for p in parameters:
        key, value = p.sample().partition("  #")[0].split(": ")
        low, high = p.usual_range
        assert key == p.key and (low <= p.read(value) <= high or isinstance(p, Inclination)), p.sample()


def test_the_examples_of_a_wheelset_are_its_own() -> None:
    samples = {p.path: p.sample() for p in parameters_of_kind("wheelset")}
    assert samples["mass"] == "mass: 1500 kg" and samples["rolling_radius"] == "rolling_radius: 0.46 m"
    assert samples["half_wheelbase"] == "half_wheelbase: 1.28 m"
    with pytest.raises(UnitError, match=r"write for example '0\.46 m'"):
        PARAMETERS["vehicle.geometry.rolling_radius"].read("0.46 kg")


def test_poorly_observable_parameters_have_a_prior() -> None:
    held = {path.rsplit(".", 1)[1] for path, p in PARAMETERS.items() if p.prior_sd}
    assert held == {"contact_angle", "roll", "spin_creep"}


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(changes=st.dictionaries(st.sampled_from([p.path for p in FORMS["bogie"]]), st.floats(0.001, 0.09), max_size=6))
def test_values_within_range_are_read_unchanged(bogie: str, changes: dict[str, float]) -> None:
    changed = parse_design(bogie).with_values(changes)
    assert {p: changed.values[p] for p in changes} == changes


def test_a_design_travels_between_processes(bogie: str) -> None:
    design = parse_design(f"{bogie}riding: {{use: local}}\n")
    assert pickle.loads(pickle.dumps(design)) == design


def test_a_design_is_read_from_a_file_or_a_text(bogie: str, tmp_path: Path, problems_of: ProblemsOf) -> None:
    path = tmp_path / "slow.yaml"
    path.write_text(bogie.replace("name: test bogie   # declared\n", ""))
    design = load_design(path)
    assert (design.name, design.source) == ("slow", path)
    assert len(design.sha256) == 64
    assert load_design(bogie).values == design.values == load_design(str(path)).values
    assert "cannot be read" in problems_of(lambda: load_design(tmp_path / "absent.yaml"))[0].message


# adjustment

ADJUSTED = "adjustment: {campaign: c, sha256: ab, names: [contact.spin_creep, vehicle.frame.mass], covariance: %s}\n"


def test_an_adjustment_holds_names_and_covariance(bogie: str) -> None:
    adjustment = parse_design(bogie + ADJUSTED % "[[1e-4, 0.5], [0.5, 2500]]").adjustment
    assert adjustment is not None
    assert adjustment.names == ("contact.spin_creep", "vehicle.frame.mass")
    assert adjustment.covariance == ((1e-4, 0.5), (0.5, 2500.0))


def test_a_changed_number_is_no_estimate(bogie: str) -> None:
    samples = ADJUSTED.replace("}\n", ", samples: [[1e-3, 20], [-1e-3, 30]]}\n") % "[[1e-4, 0.5], [0.5, 2500]]"
    design = parse_design(bogie + samples)
    assert design.present_adjustment is design.adjustment
    changed = design.with_values({"vehicle.frame.mass": 1.01 * design.value("vehicle.frame.mass")})
    present = changed.present_adjustment
    assert changed.is_set_by_hand("vehicle.frame.mass") and not changed.is_set_by_hand("contact.spin_creep")
    assert present is not None and present.names == ("contact.spin_creep",)
    assert (present.covariance, present.samples) == (((1e-4,),), ((1e-3,), (-1e-3,)))
    assert parse_design(design_text(changed)).adjustment == present


@pytest.mark.parametrize(
    "covariance",
    [
        "[[1, 2]]",
        "[[1, 2], [3, 4]]",
        "[[-1, 0], [0, 1]]",
        "[[.nan, 0], [0, 1]]",
        "[[1], [1]]",
        "[[1, 2], [2, 1]]",
        "[[0, 1], [1, 1]]",
    ],
)
def test_an_invalid_covariance_is_rejected(bogie: str, covariance: str, problems_of: ProblemsOf) -> None:
    assert problems_of(lambda: parse_design(bogie + ADJUSTED % covariance))[0].key == "adjustment.covariance"


def test_a_singular_covariance_is_accepted_with_the_rounding_of_its_digits(bogie: str) -> None:
    # correlation 1, and 1.0000004 after rounding to six digits
    for covariance in (
        "[[1e-4, 0.5], [0.5, 2500.0]]",
        "[[1.11111e-4, 0.527046], [0.527046, 2500.0]]",
        "[[0, 0], [0, 1]]",
    ):
        adjustment = parse_design(bogie + ADJUSTED % covariance).adjustment
        assert adjustment is not None and len(adjustment.covariance) == 2


def test_the_content_of_designs_differs_if_they_behave_differently(bogie: str) -> None:
    design: Design = parse_design(bogie)
    assert design.content() == parse_design(bogie.replace("55 kN", "55000 N").replace("test bogie", "other")).content()
    assert design.content() != design.with_values({"contact.spin_creep": 0.3}).content()


def test_a_rig_without_mass_is_given_the_mass_of_a_rig(problems_of: ProblemsOf) -> None:
    [problem] = problems_of(lambda: load_design("name: rotor\nvehicle: {rig: {stiffness: 2.2, damping: 0.01}}"))
    assert problem.remedy == "add `mass: 95 kg  # of a rotor its moment of inertia, a number in kg*m^2`"
