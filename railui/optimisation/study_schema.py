"""Schema of a study file, for checking and for the JSON Schema."""

from __future__ import annotations

from typing import Annotated, Any, Final

from pydantic import Field

from railui.io.fields import (
    LIST,
    LIST_OR_SCALAR,
    PAIR,
    REQUIRED_LIST_OR_SCALAR,
    Group,
    Text,
    ValueReader,
    choice_reader,
    integer_reader,
    quantity_reader,
    quantity_schema,
)
from railui.io.units import read_speed

AGGREGATES: Final = ("mean", "worst", "p95")
METHODS: Final = ("nsga2", "nsga3", "cmaes", "de")


Speed = Annotated[float, ValueReader(read_speed, quantity_schema("m/s", unit="m/s"))]
Whole = Annotated[int, integer_reader()]
RANGES = ValueReader(
    lambda value: value,
    {
        "type": "object",
        "additionalProperties": {"type": "array", "minItems": 2, "maxItems": 2, "items": quantity_schema("")},
    },
)
SCENARIO = ValueReader(
    lambda value: {} if value is None else value,
    {"type": "object", "additionalProperties": quantity_schema("")},
)


class CasesModel(Group):
    """Tracks x speeds x seeds x scenarios (x samples of the calibrated parameters)."""

    track: Annotated[list[Text], REQUIRED_LIST_OR_SCALAR] = Field(
        json_schema_extra={"sample": "track: [erri_b176_low length=2000]"}
    )
    speed: Annotated[list[Speed], REQUIRED_LIST_OR_SCALAR] = Field(json_schema_extra={"sample": "speed: [40 m/s]"})
    seed: Annotated[list[Whole], LIST_OR_SCALAR] = Field(default_factory=lambda: [0])
    scenario: Annotated[list[Annotated[dict[str, Any], SCENARIO]], LIST_OR_SCALAR] = Field(
        default_factory=lambda: list[dict[str, Any]]([{}]),
        title="overrides of the design; by default conicity 0.1 and 0.4, each with friction 0.2 and 0.4, and the "
        "unchanged design twice; [{}]: the unchanged design alone",
    )
    draws: Annotated[int, integer_reader(0, 10_000)] = 0
    radius: Annotated[float, quantity_reader("m", 0.0, above=True)] = Field(
        default=600.0, title="radius of the curve, for the keys of curve"
    )
    cant_deficiency: Annotated[float, quantity_reader("m")] = Field(default=0.1, title="cant deficiency in the curve")


class ObjectiveModel(Group):
    """Objective: minimise or maximise a key of the results."""

    minimise: Text | None = None
    maximise: Text | None = None
    over: Annotated[str, choice_reader(AGGREGATES)] = "mean"


class MethodModel(Group):
    """Search method, by default nsga2; nsga3 from four objectives on; cmaes for one, de for one variable."""

    kind: Annotated[str, choice_reader(METHODS)] | None = Field(
        default=None, title="nsga2, nsga3; for one objective cmaes, de"
    )
    population: Annotated[int, integer_reader(4, 100_000)] = 64
    generations: Annotated[int, integer_reader(1, 1_000_000)] = 20
    seed: Annotated[int, integer_reader()] = 1


class StudyModel(Group):
    """Schema of study.yaml."""

    schema_: Text = Field(default="railui.study/1", alias="schema")
    name: Text = ""
    vehicle: Text = Field(json_schema_extra={"sample": "vehicle: adjusted.yaml"})
    variables: Annotated[dict[str, Annotated[list[Any], PAIR]], RANGES]
    cases: CasesModel
    objectives: Annotated[list[ObjectiveModel], LIST] = Field(
        json_schema_extra={"sample": "objectives: [{minimise: weighted_acceleration, over: mean}]"}
    )
    constraints: Annotated[list[Text], LIST] = Field(default_factory=list)
    method: MethodModel = Field(default_factory=MethodModel)
