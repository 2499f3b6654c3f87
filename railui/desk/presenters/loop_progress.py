"""A loop as far as it has come: errors, moving parameters, the ranking as it fills, each as rows of bars."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from railui.campaign.campaign import Campaign
from railui.campaign.dataset import Dataset
from railui.campaign.finding import Finding
from railui.desk.presenters.loop_views import Closed, error, named, share, short
from railui.desk.presenters.written import symbol
from railui.desk.widgets.bars import Bar
from railui.identification.estimation.validation import NoiseFloor
from railui.identification.events import FitIteration, ModelValidated, ScoreTestProgress
from railui.identification.structure.evidence import ScoreResult, signed_rho
from railui.identification.structure.refit import Refit
from railui.identification.structure.score_test import ScoreTestResult
from railui.io.number_format import display, pretty
from railui.io.problems import FileProblems
from railui.vehicle.model import Model
from railui.vehicle.parameters import PARAMETERS

SHOWN = 60  # rows of the ranking
OFTEN = 0.1  # s between two pictures of a ranking that fills
STATES = ("declared", "before", "after")


class Progress:
    """What the events of one loop amount to, until its verdict and with it."""

    def __init__(self, campaign: Campaign | None = None) -> None:
        self.campaign = campaign
        self.errors: dict[str, Mapping[str, float]] = {}
        self.totals: dict[str, float] = {}
        self.turn: FitIteration | None = None
        self.seen: dict[Any, ScoreResult] = {}
        self.refits: dict[Any, float] = {}
        self.fitted: Model | None = None  # whose parameters are moving
        self.measurement: Dataset | None = None
        self.findings: Sequence[Finding] = ()
        self.fault = ""  # why the runs cannot be read
        self.closed: Closed | None = None
        self.lines: list[str] = []
        self.doing = ""
        self._drawn = 0.0  # when the ranking was drawn last

    def take(self, event: object) -> str:
        """One event of the loop; returns what it changed: errors, moving, ranking, or nothing."""
        if isinstance(event, ModelValidated):
            self.errors[event.which], self.totals[event.which] = event.judgement.channels, event.judgement.nrmse
            return "errors"
        if isinstance(event, NoiseFloor):
            self.errors["floor"], self.totals["floor"] = event.channels, event.nrmse
            return "errors"
        if isinstance(event, FitIteration):
            self.turn = event
            self.doing = f"adjusting, step {event.iteration}, {event.simulations} simulated vehicles"
            return "moving"
        if isinstance(event, ScoreTestProgress):
            return self._look(event)
        if isinstance(event, Refit):
            self.refits[event.candidate], self.fitted = event.rss, event.fit.model
            return "ranking"
        if isinstance(event, ScoreResult):
            self.doing = f"fitting {named(event.candidate)}"
        elif isinstance(event, ScoreTestResult):
            self.doing = "fitting the best candidates with everything else"
        return ""

    def _look(self, event: ScoreTestProgress) -> str:
        """A bundle of candidates more."""
        if event.done == 1:
            self.seen, self.refits = {}, {}
        self.doing = f"tracing, {100 * event.done // event.total} % of the catalogue"
        for one in event.sightings:
            if one.candidate not in self.seen or signed_rho(one) > signed_rho(self.seen[one.candidate]):
                self.seen[one.candidate] = one
        if event.done < event.total and time.monotonic() - self._drawn <= OFTEN:
            return ""
        self._drawn = time.monotonic()
        return "ranking"

    def close(self, closed: Closed) -> None:
        """The verdict."""
        self.closed, self.doing = closed, ""
        found = closed.found
        self.errors["after"], self.totals["after"] = (
            found.validations["after"].channels,
            found.validations["after"].nrmse,
        )
        self.errors["floor"], self.totals["floor"] = found.floor.channels, found.floor.nrmse

    # as rows

    def error_rows(self, narrow: bool) -> list[Bar]:
        """A row per channel: as it is now, pale what it was declared, the floor as a line."""
        declared = self.errors.get("declared", {})
        now = self.errors.get("after") or self.errors.get("before") or declared
        worst = max([1e-9, *(v for v in declared.values() if np.isfinite(v)), *now.values()])
        worst = worst if np.isfinite(worst) else 1.0
        judged = [w for w in STATES if w in self.errors]

        def row(name: str, found: Mapping[str, float], strong: bool = False) -> Bar:
            path = " ▸ ".join(error(found[w]) for w in (judged[-1:] if narrow else judged))
            told = path + (f" ┃ {error(found['floor'])}" if "floor" in found else "")
            mark = found["floor"] / worst if "floor" in found else None
            return Bar(name, share(found[judged[-1]], worst), told, share(found["declared"], worst), mark, strong)

        rows = [row("all", self.totals, True)] if judged else []
        return rows + [row(c, {w: e[c] for w, e in self.errors.items() if c in e}) for c in now]

    def moving_rows(self, narrow: bool) -> list[Bar]:
        """A row per parameter: its value, how far it moved, and rho as a bar that goes to zero."""
        turn, campaign = self.turn, self.campaign
        if turn is None or campaign is None:
            return []
        rows = []
        for path, value, rho in zip(turn.paths, turn.values, turn.rho, strict=True):
            declared = campaign.design.values.get(path)
            moved = f"{100 * (value / declared - 1):+.0f} %" if declared else ""
            told = f"{pretty(display(float(value), self._unit(path), 3)):>14} {moved:>7}"
            name = symbol(PARAMETERS[path].symbol) if narrow and path in PARAMETERS else short(path)
            rows.append(Bar(name, abs(float(rho)), told))
        return rows

    def _unit(self, path: str) -> str:
        """The unit of what a fit moves; of an effect that is on trial from the model that it is tried in."""
        if path in PARAMETERS:
            return PARAMETERS[path].unit
        for design in (self.fitted.design if self.fitted else None, self.campaign.design if self.campaign else None):
            try:
                if design is not None:
                    return design.unit(path)
            except FileProblems:
                continue  # a sensor's, or a point of a curve
        return "1"

    def ranking_rows(self, narrow: bool) -> list[Bar]:
        """Candidates by what they explain; after the verdict as the report ranks them."""
        if self.closed is not None:
            return _judged_rows(self.closed.report["ranking"])
        least = min(self.refits.values(), default=1.0)
        rows = []
        for one in sorted(self.seen.values(), key=lambda s: -signed_rho(s))[:SHOWN]:
            rss = self.refits.get(one.candidate)
            told = f"{one.rho:+.3f}" + ("         " if rss is None else f"  x{min(rss / least, 999.9):6.2f}")
            best = rss is not None and rss <= least
            told = told[:6] if narrow else told
            rows.append(
                Bar(named(one.candidate, narrow), signed_rho(one), told, strong=best, role="now" if rss else "base")
            )
        return rows

    @property
    def ranked_by(self) -> str:
        """What the numbers of the ranking are."""
        if self.closed is not None:
            return "rho, error, how often best"
        return "rho, misfit over the best" if self.refits else "rho" if self.seen else ""


def _judged_rows(ranked: Sequence[Mapping[str, Any]]) -> list[Bar]:
    rows = []
    for i, row in enumerate(ranked[:SHOWN]):
        which = f" {row['wheelset']}" if row["wheelset"] else ""
        place = f", {row['at'].replace('_', ' ')}{which}" if row["at"] else " added"
        name = ("nothing" if row["kind"] == "none" else row["kind"].replace("_", " ")) + place
        weight = f" {100 * row['weight']:3.0f} %" if row["weight"] else "      "
        told = f"{row['rho']:+.3f} {row['nrmse']:.3f}{weight}"
        rows.append(Bar(name, abs(row["rho"]), told, strong=i == 0, role="now" if row["refitted"] else "base"))
    return rows
