"""The shape of a design file, built from the list of parameters: for checking and for the JSON Schema."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Annotated, Any

from pydantic import Field, create_model
from pydantic.config import JsonDict

from railui.io.fields import LISTED, Group, Objects, Reader, Switch, Text, quantity_schema, word
from railui.vehicle.parameters import FORMS, RIDING, SETTINGS, Parameter, nested, settings_of


class AdjustmentModel(Group):
    """What an adjustment leaves behind: which campaign, the adjusted paths, their covariance."""

    campaign: Text
    sha256: Text = ""
    names: Annotated[list[Text], LISTED]
    covariance: Annotated[list[Annotated[list[float], LISTED]], LISTED]


def number(parameter: Parameter) -> tuple[Any, Any]:
    """The field of one parameter."""
    p = parameter
    more: dict[str, Any] = {"title": p.caption, "unit": p.unit, "symbol": p.symbol}
    more |= {k: v for k, v in {"origin": p.origin, "prior_standard_deviation": p.prior}.items() if v}
    bounds = {"exclusiveMinimum" if p.above else "minimum": p.minimum, "maximum": p.maximum}
    schema = quantity_schema(p.unit, **more)
    schema["anyOf"][0] |= {k: v for k, v in bounds.items() if abs(v) < float("inf")}
    kind = Annotated[float, Reader(p.read, schema)]
    sample: JsonDict = {"sample": p.sample()}
    if p.optional:
        return kind, Field(default=None, json_schema_extra=sample)
    if p.default is None:
        return kind, Field(json_schema_extra=sample)
    return kind, Field(default=p.default)


def setting(path: str) -> tuple[Any, Any]:
    """The field of one word or switch."""
    choices = SETTINGS[path]
    kind = Switch if isinstance(choices[0], bool) else Annotated[str, word(tuple(map(str, choices)))]
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
    """The model of a group of numbers; the paths of the parameters are its keys."""
    return _group(name, {p.path: number(p) for p in parameters})


@cache
def design_model(form: str) -> type[Group]:
    """The model of a whole design of one form: "bogie", "rig", or "vehicle" without its bodies and elements."""
    fields: dict[str, Any] = {p.path: number(p) for p in FORMS.get(form, ())}
    riding = {p.path: number(p) for p in RIDING}
    for path in settings_of(form):
        fields[path] = riding[path] if path in riding else setting(path)
    top: dict[str, Any] = {
        "schema_": (Text, Field(default="railui.design/1", alias="schema")),
        "name": (Text, ""),
        **nested(fields),
        "effects": (Objects, Field(default_factory=list)),
        "adjustment": (AdjustmentModel, None),
    }
    return _group(f"{form}_design", top)
