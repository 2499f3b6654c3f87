"""What a search leaves in its directory: the study as resolved, the result, the front, designs to build."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from railui.documents.saving import save_design
from railui.execution import cache, lock
from railui.io.atomic import relative_path, write_text
from railui.io.problems import one_problem
from railui.io.schema_line import schema_name
from railui.io.yaml_writer import flow, scalar_text
from railui.optimisation.response_keys import RESULTS
from railui.optimisation.study import Study
from railui.track.excitation import is_track_file
from railui.vehicle.design_reader import Design

STUDY, VEHICLE, RESULT, FRONT = "study.yaml", "vehicle.yaml", "result.json", "front.csv"
KNEE, REPORT = "knee.yaml", "report.html"
OURS: Final = (STUDY, VEHICLE, RESULT, FRONT, KNEE, REPORT, lock.FILE, *cache.OURS)
CHOSEN: Final = re.compile(r"chosen_\d+\.yaml|\..*\.part")


def check_directory(study: Study, directory: str | Path) -> Path:
    """The directory, where a search may write into it; FileProblems where it holds what is not its own."""
    path = Path(directory)
    if not path.exists():
        return path
    told = "choose another directory with -o"
    if not path.is_dir():
        raise one_problem(path, "is a file", told)
    names = sorted(entry.name for entry in path.iterdir())
    foreign = [name for name in names if name not in OURS and not CHOSEN.fullmatch(name)]
    if foreign:
        raise one_problem(path, f"holds files that are not of a search, such as {foreign[0]}", told)
    begun = (path / cache.FILE).exists()
    if not begun and (path / STUDY).exists() and (path / STUDY).samefile(study.source):
        raise one_problem(path, "holds the study itself, which the resolved one would replace", told)
    return path


def save_outcome(
    study: Study, document: Mapping[str, Any], directory: str | Path, choose: Sequence[int] = ()
) -> list[Path]:
    """Writes knee.yaml (where there is one), chosen_N.yaml, front.csv and, last, result.json; each whole or not at all.

    `choose`: indices of the front. Raises ValueError for one that is not on it.
    """
    path, front = Path(directory), document["pareto"]
    path.mkdir(parents=True, exist_ok=True)
    for i in choose:
        if not 0 <= i < len(front):
            raise ValueError(f"no design {i} on the front, which has {len(front)}, from 0 on")
    written = []
    if document["knee"] is None:
        (path / KNEE).unlink(missing_ok=True)
    else:
        written.append(save_design(chosen_design(study, document, document["knee"], "knee"), path / KNEE))
    for i in choose:
        written.append(save_design(chosen_design(study, document, i, f"design {i}"), path / f"chosen_{i}.yaml"))
    written.append(write_text(path / FRONT, front_text(study, document)))
    return [*written, write_text(path / RESULT, json.dumps(document, indent=1, allow_nan=False) + "\n")]


def chosen_design(study: Study, document: Mapping[str, Any], index: int, word: str) -> Design:
    """A design of the front as a whole one."""
    design = study.design.with_values(document["pareto"][index]["variables"])
    return replace(design, name=f"{study.name}, {word}")


def front_text(study: Study, document: Mapping[str, Any]) -> str:
    """The baseline and the front as CSV: variables, aims, limits, aims on fresh seeds with their spread; SI."""
    aims = [f"{aim['key']} {aim['over']}" for aim in document["aims"]]
    units = [RESULTS[aim["key"]].unit for aim in document["aims"]]
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(
        ["design", *(f"{v.path} [{v.unit}]" for v in study.variables)]
        + [f"{aim} [{unit}]" for aim, unit in zip(aims, units, strict=True)]
        + [f"{limit.key} [{RESULTS[limit.key].unit}]" for limit in study.constraints]
        + [f"{aim}, fresh {word} [{unit}]" for word in ("mean", "sd") for aim, unit in zip(aims, units, strict=True)]
    )
    for i, point in enumerate([document["baseline"], *document["pareto"]]):
        name = "baseline" if i == 0 else f"{i - 1}, knee" if i - 1 == document["knee"] else i - 1
        fresh = point["fresh"]
        numbers = [*point["variables"].values(), *point["objectives"], *point["constraints"]]
        rows.writerow([name, *("" if x is None else repr(x) for x in [*numbers, *fresh["mean"], *fresh["sd"]])])
    return out.getvalue()


def study_text(study: Study, directory: str | Path) -> str:
    """A study with all defaults written out, SI, as a file to stand in a directory."""
    cases = study.cases
    tracks = [
        relative_path(p, directory) if is_track_file(p := study.directory / t) and p.is_file() else t
        for t in cases.track
    ]
    vehicle = study.design.source
    lines = [f"schema: {schema_name('study')}", f"name: {scalar_text(study.name)}"]
    lines += [f"vehicle: {scalar_text(relative_path(vehicle, directory))}"] if vehicle is not None else []
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
