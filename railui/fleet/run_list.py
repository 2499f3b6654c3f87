"""Runs of a fleet with their metadata: from a table, or from the names of the files."""

from __future__ import annotations

import csv
import io
import math
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from railui.fleet.fleet_file import Fleet
from railui.fleet.schema import read_time
from railui.io.problems import Findings, file_problem, suggest_name
from railui.io.units import UnitError

NUMBERS: Final = ("mileage", "load", "temperature")
WORDS: Final = ("file", "vehicle", "time", "section")
REQUIRED: Final = ("file", "time")
FIELD: Final = re.compile(r"\\\{(\w+)\\\}")
HEADER: Final = re.compile(r"\s*(\w+)\s*(?:\[[^\]]*\])?\s*\Z")


@dataclass(frozen=True)
class FleetRun:
    """A run of a fleet.

    Attributes
    ----------
    file
        Path or address, as it is opened.
    time
        Days.
    mileage, load, temperature
        In the unit of the table; NaN: not known.
    section
        Track section where the table names it; "": decided by the triggers.
    """

    file: str
    vehicle: str
    time: float
    mileage: float = math.nan
    load: float = math.nan
    temperature: float = math.nan
    section: str = ""


def list_runs(fleet: Fleet) -> list[FleetRun]:
    """List the runs of a fleet in the order of time, vehicle and file.

    Raises
    ------
    FileProblems
        With every faulty line of the table of runs.
    """
    runs = _from_index(fleet) if fleet.runs.index is not None else _from_names(fleet)
    return sorted(runs, key=lambda run: (run.time, run.vehicle, run.file))


def _from_index(fleet: Fleet) -> list[FleetRun]:
    assert fleet.runs.index is not None
    place = fleet.runs.index if "://" in fleet.runs.index else str(fleet.directory / fleet.runs.index)
    findings = Findings(place)
    rows = csv.reader(io.StringIO(_read_text(place)))
    header = [m.group(1) if (m := HEADER.match(cell)) else cell for cell in next(rows, [])]
    for name in REQUIRED:
        if name not in header:
            findings.add("", f"has no column {name!r}", "write file,vehicle,time,mileage,load,temperature,section")
    for name in header:
        if name not in (*WORDS, *NUMBERS):
            findings.add("", f"unknown column {name!r}", suggest_name(name, [*WORDS, *NUMBERS]))
    findings.raise_errors()
    home = place.rpartition("/")[0]
    runs: list[FleetRun] = []
    files: set[str] = set()
    for number, cells in enumerate(rows, 2):
        if not any(cell.strip() for cell in cells):
            continue
        row = dict(zip(header, (cell.strip() for cell in cells), strict=False))
        run = _run_of_row(row, fleet, home, findings, (number, 1))
        if run is not None and run.file in files:
            findings.add("file", f"{row['file']} is listed twice", "list each run once", position=(number, 1))
        elif run is not None:
            files.add(run.file)
            runs.append(run)
    findings.raise_errors()
    return runs


def _run_of_row(
    row: Mapping[str, str], fleet: Fleet, home: str, findings: Findings, position: tuple[int, int]
) -> FleetRun | None:
    vehicle = row.get("vehicle") or (next(iter(fleet.vehicles)) if len(fleet.vehicles) == 1 else "")
    if vehicle not in fleet.vehicles:
        remedy = suggest_name(vehicle, fleet.vehicles)
        findings.add("vehicle", f"no vehicle {vehicle!r} in {fleet.source.name}", remedy, position=position)
        return None
    numbers = {}
    for name in NUMBERS:
        text = row.get(name, "")
        try:
            numbers[name] = float(text) if text else math.nan
        except ValueError:
            findings.add(name, f"{text!r} is not a number", "write it without a unit", position=position)
    try:
        time = read_time(row.get("time", ""))
    except UnitError as error:
        findings.add("time", error.message, error.remedy, position=position)
        return None
    file = row.get("file", "")
    file = file if "://" in file or Path(file).is_absolute() else f"{home}/{file}" if home else file
    return FleetRun(file, vehicle, time, section=row.get("section", ""), **numbers)


def _from_names(fleet: Fleet) -> list[FleetRun]:
    assert fleet.runs.pattern is not None
    pattern = fleet.runs.pattern
    remote = "://" in pattern
    place = pattern if remote else str((fleet.directory / pattern).resolve())
    expression = re.compile(FIELD.sub(lambda m: f"(?P<{m.group(1)}>[^/]+?)", re.escape(place)) + r"\Z")
    unknown = set(expression.groupindex) - {"vehicle", "time", "section"}
    if unknown:
        remedy = "write {vehicle}, {time} and {section}"
        raise file_problem(fleet.source, f"the pattern has an unknown field {min(unknown)!r}", remedy, "runs.pattern")
    findings = Findings(str(fleet.source))
    runs = []
    for file in _matching(re.sub(r"\{\w+\}", "*", place), remote):
        found = expression.match(file)
        if found is None:
            continue
        row = {**found.groupdict(), "file": file}
        run = _run_of_row(row, fleet, "", findings, (0, 0))
        if run is not None:
            runs.append(run)
    if findings.errors():
        findings.problems = [p for p in findings.problems][:10]
    findings.raise_errors()
    return runs


def _matching(glob: str, remote: bool) -> list[str]:
    """List the files that match a glob, of the disk or of an address that fsspec opens."""
    if not remote:
        import glob as local

        return sorted(local.glob(glob))
    protocol = glob.partition("://")[0]
    return sorted(f"{protocol}://{name.lstrip('/')}" for name in _file_system(glob).glob(glob))


def _file_system(address: str) -> Any:
    try:
        import fsspec
    except ImportError:
        remedy = "install the extra `railui[cluster]`, which contains fsspec, or mount the files"
        raise file_problem(address, "is an address, which needs fsspec", remedy) from None
    try:
        return fsspec.core.url_to_fs(address)[0]
    except (ValueError, ImportError) as error:
        raise file_problem(address, f"cannot be opened: {error}", "install the package that fsspec names") from None


def _read_text(place: str) -> str:
    if "://" not in place:
        return Path(place).read_text("utf-8")
    return str(_file_system(place).cat_file(place).decode("utf-8"))


@contextmanager
def local_file(file: str) -> Iterator[Path]:
    """Give a run as a local file, a temporary copy of a remote one."""
    if "://" not in file:
        yield Path(file)
        return
    with tempfile.TemporaryDirectory() as scratch:
        copy = Path(scratch) / file.rpartition("/")[2]
        _file_system(file).get_file(file, str(copy))
        yield copy


def file_version(file: str) -> str:
    """Return size and version of a remote file as its file system states them."""
    info = _file_system(file).info(file)
    known = ("size", "ETag", "etag", "mtime", "created", "LastModified", "sha256")
    return repr([(name, str(info[name])) for name in known if name in info])
