"""Pydantic types of values in YAML files, and their validation errors with positions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from railui.io.problems import Findings, suggest_name
from railui.io.units import UnitError, example_quantity, quantity, quantity_in_any_unit

Model = TypeVar("Model", bound=BaseModel)


class Group(BaseModel):
    """Group of keys that rejects unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True, defer_build=True)


def value_fault(message: str, remedy: str) -> PydanticCustomError:
    """Return an error for a validator to raise: problem and remedy."""
    return PydanticCustomError("fault", "{what}", {"what": message, "remedy": remedy})


@dataclass(frozen=True, eq=False)
class ValueReader:
    """Metadata of a field: function that reads the value in the file, and JSON Schema."""

    read: Callable[[Any], Any]
    schema: Mapping[str, Any] | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.validate, handler(source))

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return handler(core) if self.schema is None else dict(self.schema)

    def validate(self, value: Any) -> Any:
        """Read a value; raise a UnitError as a pydantic error."""
        try:
            return self.read(value)
        except UnitError as error:
            raise value_fault(error.message, error.remedy) from None


def quantity_schema(unit: str, /, **more: Any) -> dict[str, Any]:
    """Return the JSON Schema of a number in SI or a string with a unit."""
    text = f"a quantity such as '{example_quantity(unit)}'" if unit else "a number, or a quantity"
    return {"anyOf": [{"type": "number"}, {"type": "string", "description": text}], **more}


def quantity_reader(
    unit: str, minimum: float | None = None, *, above: bool = False, maximum: float | None = None
) -> ValueReader:
    """Return a reader of quantities with a unit ("" for any) and bounds; `above` excludes the minimum."""

    def read(value: Any) -> float:
        number = quantity(value, unit) if unit else quantity_in_any_unit(value)
        if minimum is not None and (number < minimum or (above and number == minimum)):
            raise UnitError(
                f"{value!r} is too small",
                f"give {'above' if above else 'at least'} {_bound_text(minimum, unit)}",
            )
        if maximum is not None and number > maximum:
            raise UnitError(f"{value!r} is too large", f"give at most {_bound_text(maximum, unit)}")
        return number

    return ValueReader(read, quantity_schema(unit, unit=unit or "any"))


def _bound_text(bound: float, unit: str) -> str:
    return f"{bound:g}" if unit in ("", "1") else f"{bound:g} {unit}"


def choice_reader(choices: tuple[str, ...]) -> ValueReader:
    """Return a reader of one of several words."""

    def read(value: Any) -> str:
        if not isinstance(value, str) or value not in choices:
            raise UnitError(f"{value!r} is not known here", suggest_name(str(value), choices))
        return value

    return ValueReader(read, {"type": "string", "enum": list(choices)})


def _read_text(value: Any) -> str:
    if isinstance(value, dict | list) or value is None:
        raise UnitError("is not a word", "write a word, or text in quotes")
    if isinstance(value, float):
        raise UnitError(f"{value!r} is a number, but a word is required", "put it in quotes")
    return str(value)


def _read_switch(value: Any) -> bool:
    if not isinstance(value, bool):
        raise UnitError(f"{value!r} is not a switch", "write true or false")
    return value


def _read_pair(value: Any) -> Any:
    if not isinstance(value, list) or len(value) != 2:
        raise UnitError("is not a pair", "write [lowest, highest]")
    return value


def _read_list(value: Any) -> Any:
    if value is None:
        return []
    if not isinstance(value, list):
        raise UnitError("is not a list", "write [one, two] or lines that begin with a dash")
    return value


def _read_list_or_scalar(value: Any) -> Any:
    if value == []:
        raise UnitError("is empty", "name one, or leave the key out")
    return value if isinstance(value, list) else [value]


def _read_required_list_or_scalar(value: Any) -> Any:
    if value in (None, []):
        raise UnitError("is empty", "name one")
    return _read_list_or_scalar(value)


def integer_reader(minimum: int = 0, maximum: int = 2**63 - 1) -> ValueReader:
    """Return a reader of integers from `minimum` to `maximum`."""

    def read(value: Any) -> int:
        number = int(value) if isinstance(value, float) and value.is_integer() else value
        if isinstance(number, bool) or not isinstance(number, int) or not minimum <= number <= maximum:
            extent = f"from {minimum} on" if maximum == 2**63 - 1 else f"from {minimum} to {maximum}"
            raise UnitError(f"{value!r} is not an integer {extent}", f"write for example {max(minimum, 1)}")
        return number

    limits = {"minimum": minimum} if maximum == 2**63 - 1 else {"minimum": minimum, "maximum": maximum}
    return ValueReader(read, {"type": "integer", **limits})


Text = Annotated[str, ValueReader(_read_text, {"type": "string"})]
Switch = Annotated[bool, ValueReader(_read_switch, {"type": "boolean"})]
LIST, LIST_OR_SCALAR, PAIR = ValueReader(_read_list), ValueReader(_read_list_or_scalar), ValueReader(_read_pair)
REQUIRED_LIST_OR_SCALAR = ValueReader(_read_required_list_or_scalar)  # of a key that cannot be left out
OBJECT: dict[str, Any] = {"type": "object"}
Objects = Annotated[list[Any], ValueReader(_read_list, {"type": "array", "items": OBJECT})]


def check_group(
    model: type[Model], value: Any, findings: Findings, path: str = "", extra: Iterable[str] = ()
) -> Model | None:
    """Validate a group of keys.

    Parameters
    ----------
    model : type of BaseModel
    value : object
        Data of the file.
    findings : Findings
        Receives every validation error with its position.
    path : str
        Path of the group in the file.
    extra : iterable of str
        Full paths to suggest for unknown keys.

    Returns
    -------
    BaseModel or None
        None if the data do not fit.
    """
    try:
        return model.model_validate(value)
    except ValidationError as error:
        for fault_ in error.errors():
            where = ".".join([path, *map(str, fault_["loc"])]).strip(".")
            message, remedy = _describe_error(fault_, model, list(extra))
            findings.add(where, message, remedy, key=fault_["type"] == "extra_forbidden")
    return None


def _describe_error(error: Any, model: type[BaseModel], extra: list[str]) -> tuple[str, str]:
    kind, given = error["type"], error["input"]
    if kind == "fault":
        return error["ctx"]["what"], error["ctx"]["remedy"]
    if kind == "extra_forbidden":
        return "unknown key", _suggest_key(str(error["loc"][-1]), _fields(model, error["loc"][:-1]), extra)
    if kind == "missing":
        return "is missing", f"add `{_example_line(model, error['loc'])}`"
    if kind in ("model_type", "dict_type", "model_attributes_type"):
        shown = "nothing" if given is None else "a list" if isinstance(given, list) else repr(given)
        return f"{shown} where a group of keys is required", "write `key: value` lines below it"
    return str(error["msg"]).lower(), "see `railui schema`"


def _suggest_key(name: str, known: dict[str, Any], extra: list[str]) -> str:
    if name == "<<":
        return "YAML 1.2 has no merge keys: write the group out, or the whole of it as *alias"
    elsewhere = [path for path in extra if path.rpartition(".")[2] == name]
    suggestion = suggest_name(name, known)
    if elsewhere and not suggestion.startswith("did you mean"):
        return f"it belongs at {' or '.join(elsewhere[:2])}"
    return suggestion


def _fields(model: type[BaseModel], loc: tuple[Any, ...]) -> dict[str, Any]:
    inner = _model_at(model, loc)
    return {field.alias or name: field for name, field in inner.model_fields.items()} if inner else {}


def _model_at(model: type[BaseModel], loc: tuple[Any, ...]) -> type[BaseModel] | None:
    here: Any = model
    for step in loc:
        if isinstance(step, int):
            continue
        fields = {field.alias or name: field for name, field in here.model_fields.items()}
        here = _find_group(fields[step].annotation) if step in fields else None
        if here is None:
            return None
    return here  # type: ignore[no-any-return]


def _find_group(kind: Any) -> type[BaseModel] | None:
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return kind
    return next((group for part in get_args(kind) if (group := _find_group(part)) is not None), None)


def _example_line(model: type[BaseModel], loc: tuple[Any, ...]) -> str:
    field = _fields(model, loc[:-1]).get(str(loc[-1]))
    return _example_of_field(str(loc[-1]), field)


def _example_of_field(key: str, field: FieldInfo | None) -> str:
    """Return `key: value` of a field, of a group with its required keys alone."""
    more = getattr(field, "json_schema_extra", None)
    if isinstance(more, dict) and "sample" in more:
        return str(more["sample"])
    group = _find_group(field.annotation) if field is not None else None
    if group is None:
        return f"{key}: ..."
    required = [(f.alias or name, f) for name, f in group.model_fields.items() if f.is_required()]
    lines = [_example_of_field(name, f) for name, f in required] or list(group.model_fields)
    return f"{key}: {{{', '.join(lines)}}}"
