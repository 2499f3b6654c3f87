"""Search of the Optimise panel as a process of its own computes it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from railui.api.events import SearchState
from railui.api.study import Study
from railui.desk.presenters.search_history import summarise_generation
from railui.optimisation.study import Study as SearchStudy
from railui.progress import Progress


class GenerationProgress(Progress):
    """Progress with summaries of the generations."""

    def __init__(self, receiver: Progress, study: SearchStudy) -> None:
        self.receiver = receiver
        self.study = study

    def event(self, event: object) -> None:
        """Pass a summary of the generation evaluated last on."""
        if isinstance(event, SearchState):
            self.receiver.event(summarise_generation(self.study, event))


def compute_search(progress: Progress, study: SearchStudy, directory: Path) -> dict[str, Any]:
    """Run a search whose evaluations are stored in a directory, and write its result and its page there."""
    return dict(Study.of(study).optimise(directory, progress=GenerationProgress(progress, study)).data)
