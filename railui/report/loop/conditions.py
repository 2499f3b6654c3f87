"""Dependence of parameters on the stated conditions of the runs, as rows of the report and in words."""

from __future__ import annotations

from typing import Any

from railui import core
from railui.identification.result import LoopResult
from railui.identification.unmodelled.condition_dependence import ConditionDependence, ConditionParameter
from railui.report.loop.wording import parameter_name, unit_location
from railui.report.numbers import quantity_with_sd
from railui.vehicle.effects import parameter_unit
from railui.vehicle.model import Model

MAX_NAMED = 3  # parameters in the note


def condition_rows(result: LoopResult) -> dict[str, Any] | None:
    """Return the parameters under every condition, SI; None where the campaign states no conditions."""
    dependence = result.conditions
    if dependence is None:
        return None
    return {
        "name": dependence.name,
        "values": list(dependence.conditions),
        "common_nrmse": dependence.common_nrmse,
        "separate_nrmse": dependence.separate_nrmse,
        "decides": result.is_by_condition,
        "parameters": [
            {
                "path": row.path,
                "unit": condition_unit(result, dependence.model, row.path),
                "values": list(row.values),
                "sd": list(row.sd),
                "p": row.p,
                "depends": row.depends,
                "alone_nrmse": row.alone_nrmse,
            }
            for row in dependence.parameters
        ],
    }


def condition_notes(result: LoopResult) -> list[str]:
    """Return which parameters depend on the condition, with their values; nothing without conditions."""
    dependence = result.conditions
    if dependence is None:
        return []
    depending = [row for row in dependence.parameters if row.depends]
    if not depending:
        return [f"no parameter depends on {dependence.name}"]
    named = "; ".join(
        f"{parameter_name(dependence.model, row.path)} {_values(result, dependence, row)}"
        for row in depending[:MAX_NAMED]
    )
    errors = (
        f"NRMSE {dependence.common_nrmse:.3f} with common, {dependence.separate_nrmse:.3f} with separate parameters"
    )
    return [f"depends on {dependence.name}: {named}. {errors}"]


def depending_parameters(result: LoopResult) -> dict[str, str]:
    """Return the values of every parameter that depends on the condition, by its path, where the verdict rests on it.

    Empty where the verdict is that on common parameters.
    """
    dependence = result.conditions
    if dependence is None or not result.is_by_condition:
        return {}
    return {row.path: _values(result, dependence, row) for row in dependence.parameters if row.depends}


def _values(result: LoopResult, dependence: ConditionDependence, row: ConditionParameter) -> str:
    unit = condition_unit(result, dependence.model, row.path)
    pairs = zip(dependence.conditions, row.values, row.sd, strict=True)
    return ", ".join(f"{quantity_with_sd(value, sd, unit)} at {condition}" for condition, value, sd in pairs)


def condition_unit(result: LoopResult, model: Model, path: str) -> str:
    """Return the SI unit of a parameter of a model; 1 for those of sensors."""
    group, _, rest = path.partition(".")
    if group == "sensors":
        return "1"
    if group != "effects":
        return model.design.unit(path)
    number, _, key = rest.partition(".")
    effect = model.design.effects[int(number)]
    record = next((p for p in core.effect_record(effect.kind)["parameters"] if p["key"] == key), None)
    return "1" if record is None else parameter_unit(record, unit_location(result, effect.at))
