"""The shape of a study file, for checking and for the JSON Schema."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from railui.io.fields import LISTED, LISTED_OR_ONE, PAIRED, Group, Reader, Text, measure, quantity_schema, whole, word
from railui.io.units import read_speed

OVER = ("mean", "worst", "p95")
METHODS = ("nsga2", "nsga3", "cmaes", "de")


Speed = Annotated[float, Reader(read_speed, quantity_schema("m/s", unit="m/s"))]
Whole = Annotated[int, whole()]
RANGES = Reader(
    lambda value: value,
    {
        "type": "object",
        "additionalProperties": {"type": "array", "minItems": 2, "maxItems": 2, "items": quantity_schema("")},
    },
)
SCENARIO = Reader(
    lambda value: {} if value is None else value,
    {"type": "object", "additionalProperties": quantity_schema("")},
)


class CasesModel(Group):
    """Tracks x speeds x seeds x scenarios (x draws from the covariance of the adjustment)."""

    track: Annotated[list[Text], LISTED_OR_ONE] = Field(
        json_schema_extra={"sample": "track: [erri_b176_low length=2000]"}
    )
    speed: Annotated[list[Speed], LISTED_OR_ONE] = Field(json_schema_extra={"sample": "speed: [40 m/s]"})
    seed: Annotated[list[Whole], LISTED_OR_ONE] = Field(default_factory=lambda: [0])
    scenario: Annotated[list[Annotated[dict[str, Any], SCENARIO]], LISTED_OR_ONE] = Field(default=[{}])
    draws: Annotated[int, whole()] = 0
    radius: Annotated[float, measure("m", 0.0, above=True)] = Field(
        default=600.0, title="radius of the curve, for its keys"
    )
    cant_deficiency: Annotated[float, measure("m")] = Field(default=0.1, title="cant deficiency in the curve")


class ObjectiveModel(Group):
    """One aim: minimise or maximise a key of the results."""

    minimise: Text | None = None
    maximise: Text | None = None
    over: Annotated[str, word(OVER)] = "mean"


class MethodModel(Group):
    """How to search: by default nsga2, from four aims on nsga3; with one aim cmaes, with one variable de."""

    kind: Annotated[str, word(METHODS)] | None = Field(default=None, title="nsga2, nsga3; with one aim cmaes, de")
    population: Annotated[int, whole(4)] = 64
    generations: Annotated[int, whole(1)] = 20
    seed: Annotated[int, whole()] = 1


class StudyModel(Group):
    """The shape of study.yaml."""

    schema_: Text = Field(default="railui.study/1", alias="schema")
    name: Text = ""
    vehicle: Text = Field(json_schema_extra={"sample": "vehicle: adjusted.yaml"})
    variables: Annotated[dict[str, Annotated[list[Any], PAIRED]], RANGES]
    cases: CasesModel
    objectives: Annotated[list[ObjectiveModel], LISTED] = Field(
        json_schema_extra={"sample": "objectives: [{minimise: weighted_acceleration, over: mean}]"}
    )
    constraints: Annotated[list[Text], LISTED] = Field(default_factory=list)
    method: MethodModel = Field(default_factory=MethodModel)
