"""Job of the Optimise panel: run a search in its directory."""

from __future__ import annotations

from pathlib import Path

from textual.message import Message

from railui.api.events import SearchState
from railui.api.study import Study
from railui.desk.messages import JobDone, ProgressEvent
from railui.desk.presenters.search_history import summarise_generation
from railui.desk.services.jobs import BackgroundJob
from railui.optimisation.study import Study as SearchStudy
from railui.progress import Progress


class SearchProgress(Progress):
    """Progress of a search as messages to the panel; each generation is a checkpoint."""

    def __init__(self, job: BackgroundJob, study: SearchStudy) -> None:
        self.job = job
        self.study = study

    def event(self, event: object) -> None:
        """Post a summary of the generation evaluated last."""
        self.job.checkpoint()
        if isinstance(event, SearchState):
            self.job.owner.post_message(ProgressEvent(self.job.name, summarise_generation(self.study, event)))


def run_search(job: BackgroundJob, study: SearchStudy, directory: Path) -> Message:
    """Run a search whose evaluations are stored in a directory, and write its result and its page there."""
    found = Study.of(study).optimise(directory, progress=SearchProgress(job, study))
    return JobDone(job.name, dict(found.data))
