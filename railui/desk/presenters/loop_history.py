"""History of a loop: errors, fit iterations, scores and refits, collected from its events."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from railui.api.events import FitIteration, ScoreResult, ScoreTestProgress
from railui.campaign.campaign import Campaign
from railui.campaign.dataset import Dataset
from railui.campaign.faults.fault import Diagnosis
from railui.campaign.finding import Finding
from railui.desk.presenters.loop_events import CandidateRefitted, ErrorsKnown, RefitsBegun
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.vehicle.design import Design

if TYPE_CHECKING:
    from railui.report.loop.data_faults import CheckedData

MIN_REDRAW_INTERVAL: Final = 0.1  # s between two updates of the ranking
ERRORS, PARAMETERS, RANKING = "errors", "parameters", "ranking"


@dataclass(eq=False)
class Ranking:
    """Candidates of one score test: the score of each, and the residual sums of squares of those that were refitted."""

    scores: dict[Any, ScoreResult] = field(default_factory=dict)
    refits: dict[Any, float] = field(default_factory=dict)


class LoopHistory:
    """State of one loop, collected from its events and its result.

    errors and totals are NRMSE per channel and over all channels, by model: declared, before, after, floor.
    """

    def __init__(self, campaign: Campaign | None = None) -> None:
        self.campaign = campaign
        self.errors: dict[str, Mapping[str, float]] = {}
        self.totals: dict[str, float] = {}
        self.iteration: FitIteration | None = None
        self.rankings = [Ranking()]  # of every score test, the last one in progress
        self.fitted_design: Design | None = None
        self.dataset: Dataset | None = None
        self.findings: Sequence[Finding] = ()
        self.diagnosis: Diagnosis | None = None  # of the data, once they are checked
        self.stopped: CheckedData | None = None  # data with a fault at which the loop stopped
        self.read_error = ""
        self.finished: FinishedLoop | None = None
        self.lines: list[str] = []
        self.activity = ""
        self._last_redraw = 0.0

    @property
    def scores(self) -> dict[Any, ScoreResult]:
        """Scores of the last ranking."""
        return self.rankings[-1].scores

    @property
    def refits(self) -> dict[Any, float]:
        """Residual sums of squares of the candidates of the last ranking that were refitted."""
        return self.rankings[-1].refits

    def add_event(self, event: object) -> str:
        """Add a reduced event and return the part that it changes: errors, parameters, ranking, or an empty string."""
        if isinstance(event, ErrorsKnown):
            self._set_error(event.model, event.channels, event.total)
            return ERRORS
        if isinstance(event, FitIteration):
            self.iteration = event
            self.activity = f"calibration: iteration {event.iteration}, {event.simulations} simulations"
            return PARAMETERS
        if isinstance(event, ScoreTestProgress):
            return self._add_scores(event)
        if isinstance(event, CandidateRefitted):
            self.refits[event.candidate] = event.rss
            self.fitted_design = event.design
            return RANKING
        if isinstance(event, ScoreResult):
            self.activity = f"refit: {candidate_text(event.candidate)}"
        elif isinstance(event, RefitsBegun):
            self.activity = "refit of the best candidates with all parameters"
        return ""

    def finish(self, finished: FinishedLoop) -> None:
        """Add the result of the loop."""
        self.finished = finished
        self.activity = ""
        for model in ("declared", "before", "after"):  # on the whole validation runs, those before on a part of them
            validation = finished.result.validations[model]
            self._set_error(model, validation.channels, validation.nrmse)
        floor = finished.result.noise_floor
        self._set_error("floor", floor.channels, floor.nrmse)

    def _set_error(self, model: str, channels: Mapping[str, float], total: float) -> None:
        self.errors[model] = channels
        self.totals[model] = total

    def _add_scores(self, event: ScoreTestProgress) -> str:
        """Add the results of a batch of candidates; the best one counts for every candidate."""
        if event.done == 1 and self.scores:
            self.rankings.append(Ranking())
        self.activity = f"score test: {100 * event.done // event.total} % of the candidates"
        for score in event.results:
            best = self.scores.get(score.candidate)
            if best is None or score.admissible_rho > best.admissible_rho:
                self.scores[score.candidate] = score
        if event.done < event.total and time.monotonic() - self._last_redraw <= MIN_REDRAW_INTERVAL:
            return ""
        self._last_redraw = time.monotonic()
        return RANKING


def candidate_text(candidate: Any, is_narrow: bool = False) -> str:
    """Return kind and location of a candidate effect."""
    wheelset = f" {candidate.wheelset}" if candidate.wheelset else ""
    words = [word[:3] if is_narrow else word for word in candidate.at.split("_")]
    return f"{candidate.kind.replace('_', ' ')}, {' '.join(words)}{wheelset}"
