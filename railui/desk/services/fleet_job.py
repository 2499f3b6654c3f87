"""Job of the Fleet panel: compute new runs and test all vehicles."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from textual.message import Message

from railui.api.fleet import fleet_block_means, fleet_status, results_directory
from railui.desk.messages import JobDone
from railui.desk.services.child_job import run_in_child
from railui.desk.services.fleet_computation import compute_update
from railui.desk.services.jobs import BackgroundJob
from railui.fleet.block_means import BlockMeans
from railui.io.problems import FileProblems


@dataclass(frozen=True, eq=False)
class FleetResults:
    """Results of a fleet: its document and the block means of every vehicle type."""

    document: dict[str, Any]
    means: list[BlockMeans]
    directory: Path


def load_results(path: Path) -> FleetResults | None:
    """Read the results of the last update; None: there are none that can be read."""
    try:
        return FleetResults(fleet_status(path), fleet_block_means(path), results_directory(path.parent, None))
    except (FileProblems, OSError, ValueError):
        return None


def update(job: BackgroundJob, path: Path, loops: int) -> Message:
    """Compute the new runs of a fleet and test all vehicles in a process of its own; return the results."""
    run_in_child(job, compute_update, path, loops)
    return JobDone(job.name, load_results(path))
