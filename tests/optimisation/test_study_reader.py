"""Reading studies: variables, cases, objectives, constraints, and the report of all faults."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from railui.api.files import schema
from railui.io.problems import Problem
from railui.optimisation.study import Constraint, Objective, Study
from railui.optimisation.study_reader import load_study

ProblemsOf = Callable[[Callable[[], object]], list[Problem]]
STUDY = """\
vehicle: vehicle.yaml
variables:  {vehicle.primary.lateral_stiffness: [1 MN/m, 8 MN/m], vehicle.secondary.yaw_damping: [5e3, 200 kN*m*s/rad]}
cases:      {track: [erri_b176_low length=2000], speed: [40 m/s, 144 km/h], seed: [1, 2], scenario: [{}, {contact.leading.conicity: 0.3, contact.trailing.conicity: 0.3}], draws: 0}
objectives: [{minimise: weighted_acceleration, over: mean}, {maximise: flange_margin, over: worst}]
constraints: ["linear_damping >= 0.05", "comfort_hours >= 90 min", "wear_number <= 0.2 kN"]
method:     {kind: nsga2, population: 64, generations: 20, seed: 1}
"""  # noqa: E501


@pytest.fixture
def study(tmp_path: Path, bogie: str) -> Callable[..., Study]:
    """Return a reader of the study with some of its text replaced."""
    (tmp_path / "vehicle.yaml").write_text(bogie)

    def read(*changes: tuple[str, str], **more: Any) -> Study:
        text = STUDY
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "study.yaml").write_text(text)
        return load_study(tmp_path / "study.yaml", **more)

    return read


@pytest.mark.parametrize("bound", ["95 m/s", "342 km/h", "90"])
def test_a_bound_that_the_search_for_critical_speeds_does_not_reach_is_refused(
    study: Callable[..., Study], problems_of: ProblemsOf, bound: str
) -> None:
    change = ("linear_damping >= 0.05", f"linear_critical_speed >= {bound}")
    (problem,) = problems_of(lambda: study(change))
    assert (problem.line, problem.key) == (5, "constraints.0")
    assert "searched up to 90 m/s" in problem.message and "linear_damping" in problem.remedy
    assert study(("linear_damping >= 0.05", "linear_critical_speed >= 89 m/s")).constraints[0].bound == 89.0


def test_a_lateral_secondary_parameter_is_warned_of_where_comfort_does_not_follow_it(
    study: Callable[..., Study],
) -> None:
    damping = ("vehicle.secondary.yaw_damping: [5e3, 200 kN*m*s/rad]", "vehicle.secondary.lateral_damping: [1e4, 1e5]")
    guidance = [("{minimise: weighted_acceleration, over: mean}, ", ""), ('"comfort_hours >= 90 min", ', "")]
    straight = (', "wear_number <= 0.2 kN"', "")  # without a flange a curve is warned of
    (warning,) = study(damping, straight).warnings
    assert warning.key == "variables.vehicle.secondary.lateral_damping" and warning.line == 2
    assert "fixed transfer" in warning.message and "coach_mode" in warning.remedy
    assert len(study(damping, straight, guidance[0]).warnings) == 1  # the constraint on comfort
    assert not study(damping, *guidance, straight).warnings and not study(straight).warnings


def test_a_variable_that_a_coach_mode_replaces_is_warned_of(study: Callable[..., Study], tmp_path: Path) -> None:
    vehicle = tmp_path / "vehicle.yaml"
    coach = "{kind: coach_mode, at: secondary_lateral, mass: 12000, stiffness: 2e5, damping: 3e4}"
    vehicle.write_text(f"{vehicle.read_text()}\neffects:\n  - {coach}\n")
    damping = ("vehicle.secondary.yaw_damping: [5e3, 200 kN*m*s/rad]", "vehicle.secondary.lateral_damping: [1e4, 1e5]")
    (warning,) = [each for each in study(damping).warnings if "has no effect" in each.message]
    assert warning.key == "variables.vehicle.secondary.lateral_damping" and warning.line == 2
    assert warning.remedy == "change effects.0.damping"


def test_a_study_is_read_in_si(study: Callable[..., Study]) -> None:
    read = study()
    assert [(v.path, v.lowest, v.highest, v.unit) for v in read.variables] == [
        ("vehicle.primary.lateral_stiffness", 1e6, 8e6, "N/m"),
        ("vehicle.secondary.yaw_damping", 5e3, 2e5, "N*m*s/rad"),
    ]
    assert read.cases.speed == (40.0, 40.0) and read.cases.seed == (1, 2) and read.cases.draws == 0
    assert read.cases.scenario[1] == {"contact.leading.conicity": 0.3, "contact.trailing.conicity": 0.3}
    assert read.objectives == (
        Objective("weighted_acceleration", "minimise", "mean"),
        Objective("flange_margin", "maximise", "worst"),
    )
    assert read.constraints[1:] == (
        Constraint("comfort_hours", ">=", 1.5, "comfort_hours >= 90 min"),
        Constraint("wear_number", "<=", 200.0, "wear_number <= 0.2 kN"),
    )
    assert (read.method.population, read.method.generations) == (64, 20)
    assert (read.cases.radius, read.cases.cant_deficiency) == (600.0, 0.1)


def test_a_single_value_is_read_as_a_list(study: Callable[..., Study]) -> None:
    read = study(("[40 m/s, 144 km/h]", "40"), ("[erri_b176_low length=2000]", "fra_4"), ("seed: [1, 2]", "seed: 3"))
    assert (read.cases.speed, read.cases.track, read.cases.seed) == ((40.0,), ("fra_4",), (3,))


def test_all_faults_are_reported_at_once(study: Callable[..., Study], problems_of: ProblemsOf) -> None:
    problems = problems_of(
        lambda: study(
            (
                "lateral_stiffness: [1 MN/m, 8 MN/m]",
                "lateral_stifness: [1 MN/m, 8 MN/m], contact.leading: [1, 2]",
            ),
            ("200 kN*m*s/rad", "200 kN"),
            ("erri_b176_low length=2000", "erri_b176_low length 2000, gone.csv"),
            ("40 m/s, 144 km/h", "144"),
            ("draws: 0", "draws: 2"),
            ("contact.leading.conicity: 0.3", "contact.leading.conicty: 0.3"),
            ("weighted_acceleration, over: mean", "weighted_aceleration, over: meen"),
            ("maximise: flange_margin", "maximise: class"),
            (">= 0.05", "= 0.05"),
            ("wear_number <= 0.2 kN", "wear_number <= 2 m"),
            ("nsga2", "nsga"),
            ("population", "populaton"),
        )
    )
    assert [(p.line, p.key) for p in problems] == [
        (2, "variables.vehicle.primary.lateral_stifness"),
        (2, "variables.contact.leading"),
        (2, "variables.vehicle.secondary.yaw_damping.1"),
        (3, "cases.track.0"),
        (3, "cases.track.1"),
        (3, "cases.speed.0"),
        (3, "cases.scenario.1.contact.leading.conicty"),
        (3, "cases.draws"),
        (4, "objectives.0.minimise"),
        (4, "objectives.0.over"),
        (4, "objectives.1.maximise"),
        (5, "constraints.0"),
        (5, "constraints.2"),
        (6, "method.kind"),
        (6, "method.populaton"),
    ]
    assert "is it in km/h?" in problems[5].remedy


def test_repeated_and_contradicting_entries_are_refused_at_once(
    study: Callable[..., Study], problems_of: ProblemsOf
) -> None:
    problems = problems_of(
        lambda: study(
            ("seed: [1, 2]", "seed: [1, 2, 1]"),
            (
                "contact.trailing.conicity: 0.3}]",
                "contact.trailing.conicity: 0.3}, {contact.trailing.conicity: 30 %, contact.leading.conicity: 0.3}]",
            ),
            ("{maximise: flange_margin, over: worst}", "{maximise: weighted_acceleration}"),
            ('"wear_number <= 0.2 kN"', '"wear_number <= 0.2 kN", "wear_number >= 201", "linear_damping >= 0.1"'),
        )
    )
    assert [(p.line, p.key, p.message) for p in problems] == [
        (3, "cases.seed.2", "repeats cases.seed.0"),
        (3, "cases.scenario.2", "repeats cases.scenario.1"),
        (4, "objectives.1", "repeats objectives.0"),
        (5, "constraints.3", "'wear_number >= 201' contradicts constraints.2, 'wear_number <= 0.2 kN'"),
    ]
    assert all(p.column > 1 and p.remedy for p in problems)


def test_the_unchanged_design_may_have_the_weight_of_several_scenarios(study: Callable[..., Study]) -> None:
    assert study(("[{}, {contact", "[{}, {}, {contact")).cases.scenario[:2] == ({}, {})
    assert study(("comfort_hours >= 90 min", "wear_number >= 200")).constraints  # equal bounds are an equation


@pytest.mark.parametrize("key", ["track: [erri_b176_low length=2000]", "speed: [40 m/s, 144 km/h]"])
def test_a_required_list_is_not_to_be_left_out(study: Callable[..., Study], problems_of: ProblemsOf, key: str) -> None:
    for empty in ("[]", ""):
        (problem,) = problems_of(lambda empty=empty: study((key, f"{key.partition(':')[0]}: {empty}")))
        assert (problem.message, problem.remedy) == ("is empty", "name one")


def test_a_range_must_rise(study: Callable[..., Study], problems_of: ProblemsOf) -> None:
    assert "does not rise" in problems_of(lambda: study(("[1 MN/m, 8 MN/m]", "[8 MN/m, 1 MN/m]")))[0].message


def test_a_track_is_checked_by_the_given_parser(study: Callable[..., Study], problems_of: ProblemsOf) -> None:
    def refuse(text: str) -> None:
        raise ValueError(f"no spectrum in {text}")

    (problem,) = problems_of(lambda: study(check_track=refuse))
    assert problem.key == "cases.track.0" and problem.message == "no spectrum in erri_b176_low length=2000"


@pytest.mark.parametrize("key", ["variables", "cases", "objectives", "vehicle"])
def test_a_missing_required_key_is_reported(study: Callable[..., Study], key: str, problems_of: ProblemsOf) -> None:
    assert key in [p.key for p in problems_of(lambda: study((f"{key}:", f"x_{key}:")))]


@pytest.mark.parametrize(
    ("kind", "message"),
    [("nsga3", "nsga3 cannot search 1 objective"), ("cmaes", None)],
)
def test_the_method_must_suit_the_number_of_objectives(
    study: Callable[..., Study], problems_of: ProblemsOf, kind: str, message: str | None
) -> None:
    changes = [(", {maximise: flange_margin, over: worst}", ""), ("kind: nsga2", f"kind: {kind}")]
    if message is None:
        assert study(*changes).method.kind == kind
    else:
        assert problems_of(lambda: study(*changes))[0].message == message


def test_the_schema_states_the_default_scenarios_in_words() -> None:
    scenario = schema("study")["$defs"]["CasesModel"]["properties"]["scenario"]
    assert "default" not in scenario
    assert "conicity 0.1 and 0.4" in scenario["title"]
