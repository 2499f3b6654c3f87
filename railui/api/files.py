"""Files of every kind: their check, their differences and their schemas."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from railui.io.problems import Problem
from railui.progress import SILENT, Progress


def check(*files: str | Path, progress: Progress = SILENT) -> tuple[Problem, ...]:
    """Check files of any kind, as `railui check`: all errors and warnings; the runs of a campaign or fleet with it.

    Parameters
    ----------
    *files : str or Path
    progress : Progress
        Receives the number of checked runs of a fleet.

    Returns
    -------
    tuple of Problem
        With file, line, column, key, message, remedy and severity.

    Examples
    --------
    >>> check("designs/test_bogie.yaml", "designs/studies/test_bogie.yaml")
    ()
    """
    from railui.documents.check import check as check_files
    from railui.track import parse_spec

    readers: dict[str, Callable[[str | Path], object]] = {
        "map": _load_map,
        "fleet": partial(_check_fleet, progress=progress),
    }
    return tuple(check_files(files, check_track=parse_spec, readers=readers))


def _load_map(path: str | Path) -> object:
    from railui.capture.processing.sensor_map import load_map

    return load_map(path)


def _check_fleet(path: str | Path, progress: Progress) -> object:
    from railui.fleet.check import check_fleet

    return check_fleet(path, progress)


def diff(a: str | Path, b: str | Path) -> list[dict[str, Any]]:
    """List every value in which two designs, studies or campaigns differ, as `railui diff`.

    Parameters
    ----------
    a, b : str or Path
        Files.

    Returns
    -------
    list of dict
        path, a, b, unit and relative (change from a to b), units and defaults resolved.

    Raises
    ------
    FileProblems
        For faulty files, and for files of different kinds.

    Examples
    --------
    >>> diff("designs/test_bogie.yaml", "designs/test_bogie.yaml")
    []
    """
    from railui.documents.difference import differences

    return differences(a, b)


def schema(kind: str) -> dict[str, Any]:
    """Return the JSON Schema of a kind of file, as `railui schema`.

    Parameters
    ----------
    kind : {"design", "campaign", "study", "plan", "element", "line", "map", "fleet"}

    Raises
    ------
    ValueError
        For another kind.

    Examples
    --------
    >>> "runs" in schema("campaign")["properties"]
    True
    """
    from railui.capture.processing.map_schema import MapModel
    from railui.documents.schema import json_schema, schema_document
    from railui.fleet.schema import FleetModel
    from railui.io.problems import suggest_name

    if kind not in SCHEMA_KINDS:
        raise ValueError(f"no schema of {kind!r}: {suggest_name(kind, SCHEMA_KINDS)}")
    if kind in ("map", "fleet"):
        model = MapModel if kind == "map" else FleetModel
        return schema_document(kind, model.model_json_schema())
    return json_schema(kind)


SCHEMA_KINDS = ("design", "campaign", "study", "plan", "element", "line", "map", "fleet")
