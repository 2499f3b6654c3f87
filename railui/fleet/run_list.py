"""Runs of a fleet with their metadata: from a table, or from the names of the files."""

from __future__ import annotations

import csv
import math
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from railui.fleet.fleet_file import FIELD, Fleet
from railui.fleet.schema import METADATA, read_time
from railui.io.extras import install_extra
from railui.io.problems import Findings, Problem, file_problem, suggest_name, unreadable_file
from railui.io.units import UnitError
from railui.io.yaml_document import load_yaml

NUMBERS: Final = ("mileage", "load", "temperature")
DELIMITERS: Final = (",", ";", "\t")
MAX_PROBLEMS: Final = 10  # of file names that are reported
REQUIRED: Final = ("file", "time")
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
    line
        Line of the table of runs, from 1; 0 where there is no table.
    """

    file: str
    vehicle: str
    time: float
    mileage: float = math.nan
    load: float = math.nan
    temperature: float = math.nan
    section: str = ""
    line: int = field(default=0, compare=False)


def list_runs(fleet: Fleet, problems: list[Problem] | None = None) -> list[FleetRun]:
    """List the runs of a fleet in the order of time, vehicle and file.

    problems: receives those of faulty lines or names, which are then left out instead of an exception.

    Raises
    ------
    FileProblems
        With every faulty line of the table of runs, and for one that cannot be read.
    """
    runs, findings = _from_index(fleet) if fleet.runs.index is not None else _from_names(fleet)
    if problems is None:
        findings.raise_errors()
    else:
        problems += findings.problems
    return sorted(runs, key=lambda run: (run.time, run.vehicle, run.file))


def index_place(fleet: Fleet) -> str:
    """Return the path or the address of the table of runs."""
    index = fleet.runs.index or ""
    return index if "://" in index else str(fleet.directory / index)


def _from_index(fleet: Fleet) -> tuple[list[FleetRun], Findings]:
    place = index_place(fleet)
    findings = Findings(place)
    lines = _read_text(place).splitlines()
    if not lines:
        raise file_problem(place, "is empty", f"write a header, {','.join(METADATA[:3])}, and a line per run")
    rows = csv.reader(lines, delimiter=max(DELIMITERS, key=lines[0].count))
    header = _header(next(rows, []), fleet.runs.columns, findings)
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
            runs.append(replace(run, line=number))
    return runs, findings


def _header(cells: list[str], names: Mapping[str, str], findings: Findings) -> list[str]:
    """Return the columns of an index under the names of railui; unknown ones are faults unless names are given."""
    header = [m.group(1) if (m := HEADER.match(cell)) else cell.strip() for cell in cells]
    for name, own in names.items():
        matching = [j for j, cell in enumerate(cells) if own in (cell.strip(), header[j])]
        if not matching:
            findings.add("", f"has no column {own!r}", suggest_name(own, header), position=(1, 1))
        for j in matching:
            header[j] = name
    for name in REQUIRED:
        if name not in header and not (name in names and findings.errors()):
            remedy = f"name its column: `runs: {{columns: {{{name}: ...}}}}`, one of {', '.join(header)}"
            findings.add("", f"has no column {name!r}", remedy, position=(1, 1))
    for name in header:
        if name not in METADATA and not names:
            remedy = f"{suggest_name(name, METADATA)}, or `runs: {{columns: {{...}}}}`, which ignores others"
            findings.add("", f"unknown column {name!r}", remedy, position=(1, 1))
    return header


def _run_of_row(
    row: Mapping[str, str],
    fleet: Fleet,
    home: str,
    findings: Findings,
    position: tuple[int, int],
    where: str = "",
) -> FleetRun | None:
    """Read the metadata of a run; report faults after the words `where`."""
    vehicle = row.get("vehicle") or (next(iter(fleet.vehicles)) if len(fleet.vehicles) == 1 else "")
    if vehicle not in fleet.vehicles:
        remedy = suggest_name(vehicle, fleet.vehicles)
        findings.add("vehicle", f"{where}no vehicle {vehicle!r} in {fleet.source.name}", remedy, position=position)
        return None
    numbers: dict[str, Any] = {}
    for name in NUMBERS:
        text = row.get(name, "")
        try:
            numbers[name] = float(text) if text else math.nan
        except ValueError:
            findings.add(name, f"{where}{text!r} is not a number", "write it without a unit", position=position)
    try:
        time = read_time(row.get("time", ""))
    except UnitError as error:
        findings.add("time", where + error.message, error.remedy, position=position)
        return None
    file = row.get("file", "")
    file = file if "://" in file or Path(file).is_absolute() else f"{home}/{file}" if home else file
    return FleetRun(file, vehicle, time, section=row.get("section", ""), **numbers)


def _from_names(fleet: Fleet) -> tuple[list[FleetRun], Findings]:
    """List the runs whose metadata are in their names."""
    asked = fleet.runs.pattern or fleet.runs.glob or ""
    place = asked if "://" in asked else str((fleet.directory / asked).resolve())
    files = _matching(FIELD.sub("*", place), "://" in place)
    if fleet.runs.pattern is not None:
        expression = _expression_of_pattern(place)
    else:
        files.sort(key=natural_key)
        expression = re.compile(fleet.runs.regex or "")
    home = asked.partition("*")[0].rpartition("/")[0] if "://" in asked else str(fleet.directory.resolve())
    findings = load_yaml(fleet.source).findings()
    key = "runs.pattern" if fleet.runs.pattern else "runs.regex" if fleet.runs.regex else "runs.glob"
    position = findings.position(key, False)
    runs = []
    for number, file in enumerate(files, 1):
        searched = file if fleet.runs.pattern is not None else file.removeprefix(f"{home}/")
        found = expression.search(searched)
        if found is None:
            if fleet.runs.regex is not None:
                remedy = "correct the expression, or make the glob narrower"
                findings.add(key, f"does not match {searched}", remedy)
            continue
        row = {"time": str(number), **{k: x or "" for k, x in found.groupdict().items()}, "file": file}
        run = _run_of_row(row, fleet, "", findings, position, f"{searched}: ")
        if run is not None:
            runs.append(run)
    if findings.errors():
        findings.problems = findings.problems[:MAX_PROBLEMS]
    return runs, findings


def _expression_of_pattern(pattern: str) -> re.Pattern[str]:
    """Return the expression of a pattern, in which a field that is repeated has the same text each time."""
    known: set[str] = set()

    def group(field: re.Match[str]) -> str:
        name = field.group(1)
        text = f"(?P={name})" if name in known else f"(?P<{name}>[^/]+?)"
        known.add(name)
        return text

    fields = FIELD.sub(group, re.escape(pattern).replace(r"\{", "{").replace(r"\}", "}"))
    return re.compile(fields.replace(r"\*", "[^/]*") + r"\Z")


def natural_key(name: str) -> list[tuple[int, str]]:
    """Key of an order in which run_2 comes before run_10.

    >>> sorted(["run_10", "run_2"], key=natural_key)
    ['run_2', 'run_10']
    """
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name)]


def _matching(glob: str, remote: bool) -> list[str]:
    """List the files that match a glob, of the disk or of an address that fsspec opens."""
    if not remote:
        import glob as local

        return sorted(local.glob(glob, recursive=True))
    protocol = glob.partition("://")[0]
    return sorted(f"{protocol}://{name.lstrip('/')}" for name in _file_system(glob).glob(glob))


def _file_system(address: str) -> Any:
    try:
        import fsspec
    except ImportError:
        remedy = f"{install_extra('cluster')}, which contains fsspec, or mount the files"
        raise file_problem(address, "is an address, which needs fsspec", remedy) from None
    try:
        return fsspec.core.url_to_fs(address)[0]
    except (ValueError, ImportError) as error:
        raise file_problem(address, f"cannot be opened: {error}", "install the package that fsspec names") from None


def _read_text(place: str) -> str:
    try:
        data = Path(place).read_bytes() if "://" not in place else bytes(_file_system(place).cat_file(place))
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise file_problem(place, "is not text in UTF-8", "save it as CSV in UTF-8") from None
    except OSError as error:
        if "://" not in place:
            raise unreadable_file(place, error) from None
        raise file_problem(place, f"cannot be read: {type(error).__name__}", "correct the address") from None


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
