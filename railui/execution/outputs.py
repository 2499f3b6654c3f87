"""Files of a search in its directory: the resolved study, the result, the front, designs as files."""

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
from railui.execution.cache import DATABASE, DATABASE_FILES
from railui.execution.lock import LOCK_FILE
from railui.io.atomic import relative_path, write_text
from railui.io.problems import file_problem
from railui.io.schema_line import schema_name
from railui.io.yaml_writer import YamlWriter
from railui.optimisation.cases import used_seeds
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.optimisation.study import Study
from railui.track.excitation import is_track_file
from railui.vehicle.design import Design

STUDY_FILE: Final = "study.yaml"
VEHICLE_FILE: Final = "vehicle.yaml"
RESULT_FILE: Final = "result.json"
FRONT_FILE: Final = "front.csv"
KNEE_FILE: Final = "knee.yaml"
REPORT_FILE: Final = "report.html"
SEARCH_FILES: Final = (
    STUDY_FILE,
    VEHICLE_FILE,
    RESULT_FILE,
    FRONT_FILE,
    KNEE_FILE,
    REPORT_FILE,
    LOCK_FILE,
    *DATABASE_FILES,
)
SEARCH_FILE_PATTERN: Final = re.compile(r"chosen_\d+\.yaml|\..*\.part")


def check_directory(study: Study, directory: str | Path) -> Path:
    """Return the directory as a path; FileProblems if it holds files that are not of a search."""
    path = Path(directory)
    if not path.exists():
        return path
    remedy = "choose another directory with -o"
    if not path.is_dir():
        raise file_problem(path, "is a file", remedy)
    names = sorted(entry.name for entry in path.iterdir())
    foreign = [name for name in names if name not in SEARCH_FILES and not SEARCH_FILE_PATTERN.fullmatch(name)]
    if foreign:
        raise file_problem(path, f"holds files that are not of a search, such as {foreign[0]}", remedy)
    has_search, study_file = (path / DATABASE).exists(), path / STUDY_FILE
    if not has_search and study_file.exists() and study_file.samefile(study.source):
        raise file_problem(path, "holds the study itself, which the resolved one would replace", remedy)
    return path


def save_result(
    study: Study, document: Mapping[str, Any], directory: str | Path, choose: Sequence[int] = ()
) -> list[Path]:
    """Write the result of a search, each file completely or not at all.

    Parameters
    ----------
    study : Study
    document : mapping
        Result of `railui.optimisation.optimise.optimise`.
    directory : str or Path
    choose : sequence of int
        Indices of designs of the front to write as chosen_N.yaml; those that the front has not are left out.

    Returns
    -------
    list of Path
        knee.yaml (if there is a knee), chosen_N.yaml, front.csv and, last, result.json.
    """
    path, front = Path(directory), document["pareto"]
    path.mkdir(parents=True, exist_ok=True)
    written = []
    if document["knee"] is None:
        (path / KNEE_FILE).unlink(missing_ok=True)
    else:
        written.append(save_design(front_design(study, document, document["knee"], "knee"), path / KNEE_FILE))
    for i in (i for i in choose if 0 <= i < len(front)):
        written.append(save_design(front_design(study, document, i, f"design {i}"), path / f"chosen_{i}.yaml"))
    written.append(write_text(path / FRONT_FILE, front_csv(study, document)))
    return [*written, write_text(path / RESULT_FILE, json.dumps(document, indent=1, allow_nan=False) + "\n")]


def check_choice(document: Mapping[str, Any], choose: Sequence[int], directory: str | Path) -> None:
    """Raise ValueError for indices that are not on the front of a result, which a directory holds."""
    count = len(document["pareto"])
    if unknown := [str(i) for i in choose if not 0 <= i < count]:
        extent = f"has {count}, numbered from 0" if count else "is empty"
        what = f"no design {', '.join(unknown)} on the front, which {extent}"
        raise ValueError(
            f"{what}; the result is in {directory}: the same command with another number takes it from there"
        )


def front_design(study: Study, document: Mapping[str, Any], index: int, label: str) -> Design:
    """Return a design of the front as a complete design."""
    design = study.design.with_values(document["pareto"][index]["variables"])
    return replace(design, name=f"{study.name}, {label}")


def front_csv(study: Study, document: Mapping[str, Any]) -> str:
    """Return the baseline and the front as CSV in SI.

    The columns are variables, objectives, constraints, and on fresh seeds: mean and standard deviation of the
    objectives, paired differences to the baseline and to the knee with standard error and probability, the number of
    sets in which a design failed and in which it meets each constraint.
    """
    objectives = [(f"{item['key']} {item['over']}", RESPONSE_KEYS[item["key"]].unit) for item in document["aims"]]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        [
            "design",
            *(f"{v.path} [{v.unit}]" for v in study.variables),
            *(f"{name} [{unit}]" for name, unit in objectives),
            *(f"{item.key} [{RESPONSE_KEYS[item.key].unit}]" for item in study.constraints),
            *(f"{name}, fresh {word} [{unit}]" for word in ("mean", "sd") for name, unit in objectives),
            *(
                f"{name}, fresh minus {reference}{word} [{1 if word == ', p value' else unit}]"
                for reference in ("baseline", "knee")
                for word in ("", ", standard error", ", p value")
                for name, unit in objectives
            ),
            "fresh sets failed [1]",
            *(f"{item.text}, fresh sets met [1]" for item in study.constraints),
        ]
    )
    for i, point in enumerate([document["baseline"], *document["pareto"]]):
        index = i - 1
        label = "baseline" if i == 0 else f"{index}, knee" if index == document["knee"] else index
        fresh = point["fresh"]
        numbers = [*point["variables"].values(), *point["objectives"], *point["constraints"]]
        numbers += [*fresh["mean"], *fresh["sd"]]
        for difference in (fresh["minus_baseline"], fresh["minus_knee"]):
            numbers += [*difference["mean"], *difference["standard_error"], *difference["p_value"]]
        numbers += [fresh["failed"], *fresh["met"]]
        writer.writerow([label, *("" if number is None else repr(number) for number in numbers)])
    return text.getvalue()


def study_text(study: Study, directory: str | Path) -> str:
    """Return a study with all defaults, in SI, as the text of a file in a directory."""
    cases = study.cases
    writer = YamlWriter()
    writer.entry("schema", schema_name("study"))
    writer.entry("name", study.name)
    if study.design.source is not None:
        writer.entry("vehicle", relative_path(study.design.source, directory))
    with writer.block("variables"):
        for variable in study.variables:
            writer.entry(variable.path, [variable.lowest, variable.highest], comment=variable.unit)
    with writer.block("cases"):
        writer.entry("track", [_track_text(study, track, directory) for track in cases.track])
        writer.entry("speed", list(cases.speed), comment="m/s")
        if not cases.has_default_seed or used_seeds(study) in ([], list(cases.seed)):
            writer.entry("seed", list(cases.seed))
        writer.entry("scenario", [dict(scenario) for scenario in cases.scenario])
        writer.entry("draws", cases.draws)
        writer.entry("radius", cases.radius, comment="m")
        writer.entry("cant_deficiency", cases.cant_deficiency, comment="m")
    writer.items("objectives", [{item.sense: item.key, "over": item.over} for item in study.objectives])
    # the bound is in the unit of the key, so it needs no unit
    writer.entry("constraints", [f"{item.key} {item.relation} {item.bound!r}" for item in study.constraints])
    writer.entry("method", vars(study.method))
    return writer.text()


def _track_text(study: Study, track: str, directory: str | Path) -> str:
    path = study.directory / track
    return relative_path(path, directory) if is_track_file(path) and path.is_file() else track
