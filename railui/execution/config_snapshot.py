"""The configuration of a search, frozen when it begins: what it would take to search anything else."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from railui.documents.difference import leaves
from railui.io.atomic import finite, sha256_file
from railui.io.problems import one_problem
from railui.optimisation.study import Study
from railui.track.excitation import is_track_file

MAY_CHANGE: Final = ("method.generations",)  # a longer search begins as the shorter one did
SHOWN: Final = 5  # differences


def snapshot(study: Study) -> dict[str, Any]:
    """All that decides what a search finds, as JSON; tracks that are files by the hash of their bytes."""
    cases = vars(study.cases) | {"track": [_track(study, track) for track in study.cases.track]}
    adjustment = study.design.adjustment
    found = {
        "study": study.name,
        "variables": {v.path: [v.lowest, v.highest] for v in study.variables},
        "cases": cases | {"scenario": [dict(one) for one in study.cases.scenario]},
        "objectives": [vars(aim) for aim in study.objectives],
        "constraints": [[limit.key, limit.relation, limit.bound] for limit in study.constraints],
        "method": vars(study.method),
        "design": study.design.resolved(),
        "covariance": [adjustment.names, adjustment.covariance] if adjustment and study.cases.draws else None,
    }
    told: dict[str, Any] = finite(found)
    return told


def _track(study: Study, track: str) -> str:
    path = study.directory / track
    return f"sha256 {sha256_file(path)}" if is_track_file(path) and path.is_file() else track


def check_same(directory: Path, begun: Mapping[str, Any], study: Study) -> None:
    """FileProblems where a directory was begun with another configuration than this study."""
    now = dict(leaves(snapshot(study)))
    then = dict(leaves(begun))
    changed = [name for name in {**then, **now} if then.get(name) != now.get(name) and name not in MAY_CHANGE]
    if not changed:
        return
    told = [f"{name}: {then.get(name, 'absent')} -> {now.get(name, 'absent')}" for name in changed[:SHOWN]]
    more = f", and {len(changed) - SHOWN} more" if len(changed) > SHOWN else ""
    remedy = f"resume with `railui optimise {directory / 'study.yaml'}`, or choose another directory with -o"
    what = f"was begun with another configuration ({'; '.join(told)}{more})"
    raise one_problem(directory, what, remedy)
