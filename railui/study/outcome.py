"""What a search leaves in its directory: the study as resolved, the result, the design at the knee."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from railui.files.numbers import scalar_text
from railui.files.problems import FileProblems, Problem
from railui.files.saving import flow, save_design
from railui.files.schema_line import schema_name
from railui.files.study import Study
from railui.files.writing import write_text
from railui.study.optimise import knee_design
from railui.study.road import is_track_file

STUDY, RESULT, KNEE = "study.yaml", "result.json", "knee.yaml"
OURS: Final = (STUDY, RESULT, KNEE)


def check_directory(study: Study, directory: str | Path) -> Path:
    """The directory, where a search may write into it; FileProblems where it holds what is not its own."""
    path = Path(directory)
    if not path.exists():
        return path
    told = "choose another directory with -o"
    if not path.is_dir():
        raise _refused(path, "is a file", told)
    foreign = sorted(entry.name for entry in path.iterdir() if entry.name not in OURS)
    if foreign:
        raise _refused(path, f"holds files that are not of a search, such as {foreign[0]}", told)
    if (path / STUDY).exists() and (path / STUDY).samefile(study.source):
        raise _refused(path, "holds the study itself, which the resolved one would replace", told)
    other = _name_in(path / RESULT)
    if other not in (None, study.name):
        raise _refused(path, f"holds the result of another study, {other!r}", told)
    return path


def _refused(path: Path, what: str, remedy: str) -> FileProblems:
    return FileProblems([Problem(str(path), 0, 0, "", what, remedy)])


def _name_in(result: Path) -> str | None:
    try:
        return str(json.loads(result.read_text("utf-8"))["study"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def save_outcome(study: Study, document: Mapping[str, Any], directory: str | Path) -> list[Path]:
    """Writes study.yaml, knee.yaml (where there is one) and, last of all, result.json; each whole or not at all."""
    path = check_directory(study, directory)
    path.mkdir(parents=True, exist_ok=True)
    written = [write_text(path / STUDY, study_text(study, path))]
    design = knee_design(study, dict(document))
    if design is None:
        (path / KNEE).unlink(missing_ok=True)
    else:
        written.append(save_design(design, path / KNEE))
    return [*written, write_text(path / RESULT, json.dumps(document, indent=1, allow_nan=False) + "\n")]


def study_text(study: Study, directory: str | Path) -> str:
    """A study with all defaults written out, SI, as a file to stand in a directory."""
    home, cases = Path(directory).resolve(), study.cases

    def beside(path: Path) -> str:
        return Path(os.path.relpath(path.resolve(), home)).as_posix()

    tracks = [beside(p) if is_track_file(p := study.directory / t) and p.is_file() else t for t in cases.track]
    vehicle = study.design.source
    lines = [f"schema: {schema_name('study')}", f"name: {scalar_text(study.name)}"]
    lines += [f"vehicle: {scalar_text(beside(vehicle))}"] if vehicle is not None else []
    lines.append("variables:")
    lines += [f"  {v.path}: {flow([v.lowest, v.highest])}  # {v.unit}" for v in study.variables]
    lines += ["cases:", f"  track: {flow(tracks)}", f"  speed: {flow(list(cases.speed))}  # m/s"]
    lines += [f"  seed: {flow(list(cases.seed))}", f"  scenario: {flow([dict(s) for s in cases.scenario])}"]
    lines += [f"  draws: {cases.draws}", f"  radius: {scalar_text(cases.radius)}  # m"]
    lines += [f"  cant_deficiency: {scalar_text(cases.cant_deficiency)}  # m", "objectives:"]
    lines += [f"  - {flow({aim.sense: aim.key, 'over': aim.over})}" for aim in study.objectives]
    # the unit of a bound was read with it: its number is in the key's own unit
    limits = [f"{limit.key} {limit.relation} {limit.bound!r}" for limit in study.constraints]
    lines.append(f"constraints: [{', '.join(json.dumps(limit) for limit in limits)}]")
    return "\n".join([*lines, f"method: {flow(vars(study.method))}"]) + "\n"
