"""Job of the Optimise panel: run a search in its directory."""

from __future__ import annotations

from pathlib import Path

from textual.message import Message

from railui.desk.messages import JobDone
from railui.desk.services.child_job import run_in_child
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.search_computation import compute_search
from railui.optimisation.study import Study


def run_search(job: BackgroundJob, study: Study, directory: Path) -> Message:
    """Run a search in a process of its own; its evaluations, its result and its page are written into a directory."""
    return JobDone(job.name, run_in_child(job, compute_search, study, directory))
