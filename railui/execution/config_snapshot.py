"""Snapshot of the configuration of a search, so that a directory resumes only the search it was started with."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from railui.documents.difference import iter_leaves
from railui.io.atomic import sha256_file, to_json_value
from railui.io.problems import file_problem
from railui.optimisation.study import Study
from railui.track.excitation import is_track_file
from railui.vehicle.design_reader import Design

CHANGEABLE_KEYS: Final = ("method.generations",)  # a longer search repeats the generations of the shorter one
MAX_DIFFERENCES_SHOWN: Final = 5


def snapshot(study: Study) -> dict[str, Any]:
    """Return everything in a study that decides the result of the search, as JSON; track files by their SHA-256."""
    cases = vars(study.cases) | {"track": [_track_text(study, track) for track in study.cases.track]}
    del cases["has_default_seed"]  # the seeds of a track are in its text
    content: dict[str, Any] = to_json_value(
        {
            "study": study.name,
            "variables": {v.path: [v.lowest, v.highest] for v in study.variables},
            "cases": cases | {"scenario": [dict(scenario) for scenario in study.cases.scenario]},
            "objectives": [vars(objective) for objective in study.objectives],
            "constraints": [[item.key, item.relation, item.bound] for item in study.constraints],
            "method": vars(study.method),
            "design": study.design.content(),
            "covariance": _spread_of(study.design) if study.cases.draws else None,
        }
    )
    return content


def _spread_of(design: Design) -> list[Any] | None:
    adjustment = design.adjustment
    if adjustment is None:
        return None
    return [adjustment.names, adjustment.covariance, *([adjustment.samples] if adjustment.samples else [])]


def _track_text(study: Study, track: str) -> str:
    path = study.directory / track
    return f"sha256 {sha256_file(path)}" if is_track_file(path) and path.is_file() else track


def check_unchanged(directory: Path, before: Mapping[str, Any], study: Study) -> None:
    """Check a study against the snapshot of a directory; FileProblems with the differences."""
    old, new = dict(iter_leaves(before)), dict(iter_leaves(snapshot(study)))
    changed = [name for name in {**old, **new} if old.get(name) != new.get(name) and name not in CHANGEABLE_KEYS]
    if not changed:
        return
    shown = [f"{key}: {old.get(key, 'absent')} -> {new.get(key, 'absent')}" for key in changed[:MAX_DIFFERENCES_SHOWN]]
    hidden = len(changed) - MAX_DIFFERENCES_SHOWN
    more = f", and {hidden} more" if hidden > 0 else ""
    what = f"was started with another configuration ({'; '.join(shown)}{more})"
    remedy = f"resume with `railui optimise {directory / 'study.yaml'}`, or choose another directory (-o)"
    raise file_problem(directory, what, remedy)
