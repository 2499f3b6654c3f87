"""Job of the Fleet panel: compute new runs and test all vehicles."""

from __future__ import annotations

from pathlib import Path

from textual.message import Message

from railui.desk.messages import JobDone
from railui.desk.services.child_job import run_in_child
from railui.desk.services.fleet_computation import compute_update
from railui.desk.services.jobs import BackgroundJob


def update(job: BackgroundJob, path: Path, loops: int) -> Message:
    """Update a fleet in a process of its own."""
    return JobDone(job.name, run_in_child(job, compute_update, path, loops))
