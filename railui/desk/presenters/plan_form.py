"""Form rows of a search plan."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from railui.desk.state.form_rows import Field, Heading, speed_field
from railui.desk.state.plan import NO_SCENARIOS, OBJECTIVES, STUDY_SCENARIOS, USUAL_SCENARIOS, Plan

AGGREGATIONS: Final = ("mean", "worst", "p95")


def plan_rows(plan: Plan, speed_unit: str = "m/s") -> Iterator[Heading | Field]:
    """Yield the rows of the form of a plan."""
    yield Heading("variables: a adds, Delete removes")
    for path in plan.bounds:
        yield from _variable_rows(plan, path)
    yield Heading("objectives")
    for i, (objective, over) in enumerate(plan.objectives):
        known = OBJECTIVES if objective in OBJECTIVES else (*OBJECTIVES, objective)
        yield _text_field(f"objectives.{i}.objective", f"objective {i + 1}", objective, known, f"obj. {i + 1}")
        yield _text_field(f"objectives.{i}.over", f"objective {i + 1}: statistic over all cases", over, AGGREGATIONS)
    yield Heading("constraints")
    for i, constraint in enumerate(plan.constraints):
        caption = "constraint, for example linear_damping >= 0.05"
        yield _text_field(f"constraints.{i}", caption, constraint, title="constraint")
    yield _text_field("constraints.new", "new constraint; empty: none", "", title="new")
    yield from _case_rows(plan, speed_unit)
    yield from _method_rows(plan)


def _variable_rows(plan: Plan, path: str) -> Iterator[Heading | Field]:
    low, high = plan.bounds[path]
    yield Heading(path.removeprefix("vehicle.").replace(".", " ").replace("_", " "))
    for end, value in (("lowest", low), ("highest", high)):
        unit, usual = plan.unit(path), plan.design.parameter(path).usual_range
        yield Field(f"bounds.{path}.{end}", "", f"{end} value", unit, value, *plan.slider_range(path), usual=usual)


def _case_rows(plan: Plan, speed_unit: str) -> Iterator[Heading | Field]:
    yield Heading("load cases")
    yield _text_field("track", "track: a spec or a file", plan.track)
    yield replace(speed_field("speed", plan.speed, speed_unit), symbol="")
    yield _text_field("seeds", "random seeds of the track", plan.seeds)
    choices: tuple[str, ...] = (USUAL_SCENARIOS, NO_SCENARIOS)
    if plan.study is not None:
        choices = (STUDY_SCENARIOS, *choices)
    caption = "usual: low, nominal, high conicity; low, high friction"
    yield _text_field("scenarios", caption, plan.scenarios, choices)


def _method_rows(plan: Plan) -> Iterator[Heading | Field]:
    yield Heading("method")
    yield _integer_field("population", "designs in a generation", plan.population, 8, 512)
    yield _integer_field("generations", "generations", plan.generations, 1, 200)
    yield _integer_field("seed", "random seed of the search", plan.seed, 0, 100)
    yield _text_field("directory", "directory in which every evaluation is stored", plan.directory)


def _text_field(path: str, caption: str, value: str, choices: tuple[str, ...] = (), title: str = "") -> Field:
    return Field(path, "", caption, "", value, choices=choices, title=title)


def _integer_field(path: str, caption: str, value: int, low: int, high: int) -> Field:
    return Field(path, "", caption, "1", value, low, high, is_integer=True, usual=(low, high))
