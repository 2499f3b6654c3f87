"""Job of the page of maps: row after row."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from textual.message import Message

from railui.api.map_rows import map_rows
from railui.arrays import FloatArray
from railui.desk.messages import JobDone, ProgressEvent
from railui.desk.presenters.design_results import DesignResults, load_track
from railui.desk.presenters.map_text import QUANTITIES, DesignMap
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.stability_jobs import background_threads


@dataclass(frozen=True, eq=False)
class MapRow:
    """Values of a row, and the map that they belong to."""

    map: DesignMap
    values: Mapping[str, FloatArray]


def compute_map(job: BackgroundJob, wanted: DesignMap, results: DesignResults) -> Message:
    """Compute all rows of a map."""
    conditions = results.conditions
    jobs = background_threads()
    source = load_track(conditions.track)
    axes = wanted.x.axis, wanted.y.axis
    for values in map_rows(results.design, *axes, list(QUANTITIES), source, conditions.speed, jobs=jobs):
        job.checkpoint()
        job.owner.post_message(ProgressEvent(job.name, MapRow(wanted, values)))
    return JobDone(job.name, None)
