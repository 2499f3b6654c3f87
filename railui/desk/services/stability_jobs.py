"""Jobs of the Stability page: modes over speed, nonlinear critical speed, speed limit by ride criteria."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from textual.message import Message

from railui import stability
from railui.api.modes import follow_modes
from railui.desk.messages import JobDone, ProgressEvent
from railui.desk.presenters.critical_speeds import HIGHEST_SPEED, critical_key
from railui.desk.presenters.design_results import MODE_SPEEDS, Comparison, DesignResults, load_track
from railui.desk.services.files import failure_text
from railui.desk.services.jobs import BackgroundJob, Checkpoints
from railui.progress import Stopped

if TYPE_CHECKING:
    from railui.running_stability.mode_tracking import TrackedMode

SPEEDS: Final = np.arange(5.0, HIGHEST_SPEED + 1.0, 5.0)  # m/s


@dataclass
class ModesTracked(Message):
    """Modes of a design and of its base over speed."""

    results: Comparison
    current: list[TrackedMode]
    base: list[TrackedMode]


@dataclass(frozen=True)
class CriticalSpeedEvent:
    """Beginning (result None) or end of the computation of one critical speed."""

    key: str
    kind: str
    result: dict[str, Any] | None = None


def background_threads() -> int:
    """Return the threads of a long computation, which leaves one processor for what the user does next."""
    return max(1, (os.cpu_count() or 2) - 1)


def track_both(results: Comparison) -> Message:
    """Follow the modes of a design and of its base."""
    current, base = (follow_modes(each.design, MODE_SPEEDS) for each in results)
    return ModesTracked(results, current, base)


def compute_critical(job: BackgroundJob, wanted: Sequence[tuple[DesignResults, str]]) -> Message:
    """Compute critical speeds one after the other; each, or its failure, is posted as soon as it is known."""
    for results, kind in wanted:
        key = critical_key(results.design, results.conditions.track)
        job.checkpoint()
        job.owner.post_message(ProgressEvent(job.name, CriticalSpeedEvent(key, kind)))
        result = _critical(job, results, kind)
        job.owner.post_message(ProgressEvent(job.name, CriticalSpeedEvent(key, kind, result)))
    return JobDone(job.name, None)


def _critical(job: BackgroundJob, results: DesignResults, kind: str) -> dict[str, Any]:
    """Return one critical speed; of a computation that failed no speed, and the text of its error."""
    try:
        return _nonlinear(job, results) if kind == "nonlinear" else _ride_criteria(job, results)
    except Stopped:
        raise
    except Exception as error:
        return {"speed": None, "failure": failure_text(error)}


def _nonlinear(job: BackgroundJob, results: DesignResults) -> dict[str, Any]:
    """Return the nonlinear critical speed with the limit cycles over speed."""
    found = stability(results.design, SPEEDS.tolist(), fold=True, jobs=background_threads(), progress=Checkpoints(job))
    return {"speed": found["fold_speed"], **found["fold"]}


def _ride_criteria(job: BackgroundJob, results: DesignResults) -> dict[str, Any]:
    track, jobs = load_track(results.conditions.track), background_threads()
    found = stability(results.design, SPEEDS.tolist(), track=track, jobs=jobs, progress=Checkpoints(job))
    return dict(found["practical"])
