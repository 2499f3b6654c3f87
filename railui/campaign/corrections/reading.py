"""Keys of the `sensors` entry of a campaign file: a list of sensor effects, or a mapping of corrections by column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import Field

from railui.campaign.corrections.correction import EFFECTS, TRACK_OFFSET, Correction, Corrections, factor_of_unit
from railui.io.fields import LIST_OR_SCALAR, OBJECT, Group, Switch, Text, ValueReader, check_group, quantity_reader
from railui.io.problems import Findings, suggest_name
from railui.io.units import UnitError, quantity
from railui.runs.columns import RIG_FORMS, Form, columns_of


class CorrectionModel(Group):
    """Schema of the corrections of one column: how its record differs from the truth."""

    gain: Annotated[float, quantity_reader("1")] = Field(default=1.0, title="recorded over true value")
    unit: Text | None = Field(default=None, title="unit of the numbers, which replaces that of the header")
    delay: Annotated[float, quantity_reader("s")] = Field(default=0.0, title="time by which the record is late")
    clock_rate: Annotated[float, quantity_reader("1", 0.0, above=True)] = Field(
        default=1.0, title="rate of the logger's clock over that of t"
    )
    swap_with: Text | None = Field(default=None, title="column with which the record was exchanged")
    gravity: Annotated[float, quantity_reader("m/s^2")] = Field(
        default=0.0, title="recorded acceleration per radian of cross-level"
    )
    hum: Annotated[float, quantity_reader("Hz", 0.0)] = Field(default=0.0, title="frequency of a line to subtract")
    leave_out: Switch = Field(default=False, title="the column is not used")
    runs: Annotated[list[Text], LIST_OR_SCALAR] = Field(default_factory=list, title="runs concerned; all by default")


def _read_sensors(value: Any) -> Any:
    if value is None:
        return []
    if not isinstance(value, list | dict):
        raise UnitError("is neither a list nor a mapping", "write a list of effects, or `{rf: {gain: -1}}`")
    return value


SENSORS = ValueReader(
    _read_sensors,
    {
        "anyOf": [
            {"type": "array", "items": OBJECT},
            {
                "type": "object",
                "properties": {
                    EFFECTS: {"type": "array", "items": OBJECT},
                    TRACK_OFFSET: {"title": "distance by which the track is recorded too far along the line"},
                },
                "additionalProperties": CorrectionModel.model_json_schema(),
            },
        ],
        "title": "effects of the sensors, or corrections by column",
    },
)


def effects_of(raw: Any) -> tuple[list[Any], str]:
    """Return the list of sensor effects in a `sensors` entry, and its path in the file."""
    if isinstance(raw, Mapping):
        effects = raw.get(EFFECTS)
        return (effects if isinstance(effects, list) else []), f"sensors.{EFFECTS}"
    return (raw if isinstance(raw, list) else []), "sensors"


def read_corrections(raw: Any, kind: Form, runs: Sequence[str], findings: Findings) -> Corrections:
    """Read the corrections of a `sensors` mapping and report every fault in it.

    Parameters
    ----------
    kind
        "bogie", "rig", "bench", or the columns of a vehicle.
    runs
        Names of the campaign's runs.
    """
    if not isinstance(raw, Mapping):
        return Corrections()
    columns = columns_of(kind)
    known = [name for name, column in columns.items() if column.role != "clock"]
    channels: list[Correction] = []
    for name, value in raw.items():
        path = f"sensors.{name}"
        if name == EFFECTS:
            if not isinstance(value, list):
                findings.add(path, "is not a list", "write [{kind: sensor_gain, at: e1, gain: 0.9}]")
        elif name == TRACK_OFFSET:
            continue
        elif name not in known:
            names = [*known, EFFECTS, *([TRACK_OFFSET] if kind not in RIG_FORMS else [])]
            findings.add(path, "unknown column", suggest_name(str(name), names), key=True)
        elif isinstance(value, list):
            for i, entry in enumerate(value):
                channels += _correction(name, entry, f"{path}.{i}", kind, runs, findings)
        else:
            channels += _correction(name, value, path, kind, runs, findings)
    return Corrections(tuple(channels), _track_offset(raw.get(TRACK_OFFSET), kind, runs, findings))


def _correction(
    name: str, value: Any, path: str, kind: Form, runs: Sequence[str], findings: Findings
) -> list[Correction]:
    if not isinstance(value, Mapping):
        findings.add(path, "is not a mapping", f"write `{name}: {{gain: -1}}`")
        return []
    model = check_group(CorrectionModel, value, findings, path)
    if model is None:
        return []
    columns = columns_of(kind)
    if model.gain == 0.0:
        findings.add(f"{path}.gain", "is 0", "give the recorded over the true value, such as -1; or leave_out: true")
        return []
    if model.swap_with is not None:
        same = [c for c, column in columns.items() if column.unit == columns[name].unit and c != name]
        if model.swap_with not in same:
            findings.add(
                f"{path}.swap_with",
                f"{model.swap_with!r} is no other column in {columns[name].unit or 'this run'}",
                suggest_name(model.swap_with, same),
            )
    if model.unit is not None:
        _check_unit(model.unit, columns[name].unit, f"{path}.unit", findings)
    if model.gravity and name not in ("ay1", "ay2", "ayf"):
        findings.add(f"{path}.gravity", f"{name} is no accelerometer of the bogie", "give it to ay1, ay2 or ayf")
    if model.leave_out and columns[name].role == "track":
        findings.add(f"{path}.leave_out", f"the track column {name} is an input", "remove the column from the runs")
    for run in model.runs:
        if run not in runs:
            findings.add(f"{path}.runs", f"{run!r} is no run of the campaign", suggest_name(run, runs))
    return [Correction(name, **{**model.model_dump(), "runs": tuple(model.runs)})]


def _check_unit(unit: str, expected: str, path: str, findings: Findings) -> None:
    try:
        factor_of_unit(unit, expected or unit)
    except UnitError as error:
        findings.add(path, error.message, error.remedy)


def _track_offset(raw: Any, kind: Form, runs: Sequence[str], findings: Findings) -> dict[str, float]:
    if raw is None:
        return {}
    if kind in RIG_FORMS:
        findings.add(f"sensors.{TRACK_OFFSET}", f"a {kind} has no track", "leave it out", key=True)
        return {}
    offsets: dict[str, float] = {}
    for run, value in (raw if isinstance(raw, Mapping) else {"": raw}).items():
        path = f"sensors.{TRACK_OFFSET}" + (f".{run}" if run else "")
        if run and run not in runs:
            findings.add(path, f"{run!r} is no run of the campaign", suggest_name(str(run), runs), key=True)
            continue
        try:
            offsets[run] = quantity(value, "m")
        except UnitError as error:
            findings.add(path, error.message, error.remedy)
    return offsets
