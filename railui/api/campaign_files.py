"""Files of a campaign that is built of runs: the vehicle, the runs and campaign.yaml."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from railui.api.run import Run
from railui.documents.saving import save_design
from railui.io.atomic import relative_path, write_text
from railui.io.problems import file_problem
from railui.io.schema_line import schema_name
from railui.io.yaml_writer import YamlWriter
from railui.runs.run import Run as MeasuredRun
from railui.vehicle.design import Design

CAMPAIGN_FILE, VEHICLE_FILE = "campaign.yaml", "vehicle.yaml"
RunLike = MeasuredRun | str | Path
ROLES = {"estimation": "adjust", "validation": "validate", "test": "test"}  # words of the file


@dataclass(frozen=True, eq=False)
class RoledRun:
    """Run with its role, estimation, validation or test."""

    run: MeasuredRun
    role: str


def roled_runs(**by_role: Iterable[RunLike] | RunLike) -> list[RoledRun]:
    """Return runs with their roles; paths are read.

    Raises
    ------
    FileProblems
        For a run that cannot be read.
    """
    return [
        RoledRun(run if isinstance(run, MeasuredRun) else Run.load(run), role)
        for role, runs in by_role.items()
        for run in ([runs] if isinstance(runs, MeasuredRun | str | Path) else runs)
    ]


def write_campaign_files(
    directory: Path, name: str, design: Design, runs: Sequence[RoledRun], keys: Mapping[str, Any]
) -> Path:
    """Write vehicle.yaml, the runs that have no file, and campaign.yaml with further keys; return its path.

    Raises
    ------
    FileProblems
        If the directory has a campaign.
    """
    file = directory / CAMPAIGN_FILE
    if file.exists():
        raise file_problem(file, "exists and is not overwritten", "name another directory")
    directory.mkdir(parents=True, exist_ok=True)
    save_design(design, directory / VEHICLE_FILE)
    writer = YamlWriter()
    writer.entry("schema", schema_name("campaign"))
    writer.entry("name", name)
    writer.entry("vehicle", VEHICLE_FILE)
    writer.items("runs", _write_runs(directory, runs))
    for key, value in keys.items():
        if value is not None:
            writer.entry(key, value)
    return write_text(file, writer.text())


def _write_runs(directory: Path, runs: Sequence[RoledRun]) -> list[dict[str, Any]]:
    """Write the runs without a file, and return the entries of all."""
    entries: list[dict[str, Any]] = []
    names: set[str] = set()
    for item in runs:
        run = item.run
        conditions = dict(run.conditions) if isinstance(run, Run) else {}
        entry = {"file": _file_of(directory, run, names), "role": ROLES[item.role]}
        entries.append(entry | ({"conditions": conditions} if conditions else {}))
    return entries


def _file_of(directory: Path, run: MeasuredRun, names: set[str]) -> str:
    """Return the file of a run relative to the directory; a run of arrays is written, under a name of its own."""
    if not isinstance(run, Run) or run.table is None:
        return relative_path(run.file, directory)
    stem = "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in run.name)
    stem = stem.removesuffix(".gz").removesuffix(".csv") or "run"
    candidates = (stem, *(f"{stem}_{i}" for i in range(2, len(names) + 3)))
    free = next(f"{name}.csv.gz" for name in candidates if f"{name}.csv.gz" not in names)
    names.add(free)
    run.save(directory / free)
    return free
