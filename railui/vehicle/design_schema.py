"""Pydantic models of design files, built from the parameter list, for validation and for the JSON Schema."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Annotated, Any

from pydantic import Field, create_model
from pydantic.config import JsonDict

from railui.io.fields import LIST, Group, Objects, Switch, Text, ValueReader, choice_reader, quantity_schema
from railui.vehicle.parameter import Parameter
from railui.vehicle.parameters import FORMS, RIDING, SETTINGS, nest, setting_paths


class AdjustmentModel(Group):
    """`adjustment` of a design: campaign, estimated paths, their covariance, samples of their deviations."""

    campaign: Text
    sha256: Text = ""
    names: Annotated[list[Text], LIST]
    covariance: Annotated[list[Annotated[list[float], LIST]], LIST]
    samples: Annotated[list[Annotated[list[float], LIST]], LIST] = Field(default_factory=list)


def number_field(parameter: Parameter) -> tuple[Any, Any]:
    """Return the model field of a parameter."""
    p = parameter
    more: dict[str, Any] = {"title": p.caption, "unit": p.unit, "symbol": p.symbol}
    more |= {k: v for k, v in {"origin": p.origin, "prior_standard_deviation": p.prior_sd}.items() if v}
    bounds = {"exclusiveMinimum" if p.exclusive_minimum else "minimum": p.minimum, "maximum": p.maximum}
    schema = quantity_schema(p.unit, **more)
    schema["anyOf"][0] |= {k: v for k, v in bounds.items() if abs(v) < float("inf")}
    kind = Annotated[float, ValueReader(p.read, schema)]
    sample: JsonDict = {"sample": p.sample()}
    if p.optional:
        return kind, Field(default=None, json_schema_extra=sample)
    if p.default is None:
        return kind, Field(json_schema_extra=sample)
    return kind, Field(default=p.default)


def setting_field(path: str) -> tuple[Any, Any]:
    """Return the model field of a word or switch."""
    choices = SETTINGS[path]
    kind = Switch if isinstance(choices[0], bool) else Annotated[str, choice_reader(tuple(map(str, choices)))]
    return kind, choices[0]


def _group(name: str, tree: dict[str, Any]) -> type[Group]:
    fields: dict[str, Any] = {}
    for key, entry in tree.items():
        if isinstance(entry, dict):
            model = _group(f"{name}_{key}", entry)
            free = not any(field.is_required() for field in model.model_fields.values())
            fields[key] = (model, Field(default_factory=model)) if free else (model, ...)
        else:
            fields[key] = entry
    return create_model(name, __base__=Group, **fields)


def number_group(name: str, parameters: Iterable[Parameter]) -> type[Group]:
    """Return the model of a group of numbers; the paths of the parameters are its keys."""
    return _group(name, {p.path: number_field(p) for p in parameters})


@cache
def design_model(form: str) -> type[Group]:
    """Return the model of a "bogie", a "rig", or a "vehicle" without its bodies and elements."""
    fields: dict[str, Any] = {p.path: number_field(p) for p in FORMS.get(form, ())}
    riding = {p.path: number_field(p) for p in RIDING}
    for path in setting_paths(form):
        fields[path] = riding[path] if path in riding else setting_field(path)
    top: dict[str, Any] = {
        "schema_": (Text, Field(default="railui.design/1", alias="schema")),
        "name": (Text, ""),
        **nest(fields),
        "effects": (Objects, Field(default_factory=list)),
        "adjustment": (AdjustmentModel, None),
    }
    return _group(f"{form}_design", top)
