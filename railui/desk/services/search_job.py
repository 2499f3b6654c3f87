"""Job of the Optimise panel: run a search in its directory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from textual.message import Message

import railui
from railui.core import simd_level
from railui.desk.messages import JobDone, ProgressEvent
from railui.desk.presenters.search_history import summarise_generation
from railui.desk.services.jobs import BackgroundJob
from railui.execution.session import Session
from railui.execution.threads import ThreadRunner
from railui.io.atomic import to_json_value
from railui.optimisation.optimise import optimise
from railui.optimisation.search import SearchState
from railui.optimisation.study import Study
from railui.progress import Progress


class SearchProgress(Progress):
    """Progress of a search as messages to the panel; each generation is a checkpoint."""

    def __init__(self, job: BackgroundJob, study: Study) -> None:
        self.job = job
        self.study = study

    def event(self, event: object) -> None:
        """Post a summary of the generation evaluated last."""
        self.job.checkpoint()
        if isinstance(event, SearchState):
            self.job.owner.post_message(ProgressEvent(self.job.name, summarise_generation(self.study, event)))


def run_search(job: BackgroundJob, study: Study, directory: Path) -> Message:
    """Run a search whose evaluations are stored in a directory, and write its result there."""
    with Session(study, directory, ThreadRunner()) as session:
        progress = session.progress(SearchProgress(job, study))
        result = optimise(study, evaluator=session.evaluator, progress=progress)
        session.finish(_document(study, result))
    return JobDone(job.name, result)


def _document(study: Study, result: dict[str, Any]) -> dict[str, Any]:
    """Return the result in the form that `railui optimise` writes."""
    head = {
        "schema": "railui.optimise/1",
        "version": railui.__version__,
        "inputs": [],
        "seed": study.method.seed,
        "simd": simd_level(),
    }
    return {**head, **to_json_value(result)}
