"""Campaigns of a session: each with its loop, and the table that lists them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from railui.campaign.campaign import Campaign
from railui.desk.presenters.loop_history import LoopHistory
from railui.desk.presenters.loop_rows import candidate_name
from railui.desk.presenters.loop_text import error_text
from railui.desk.services.verdict_file import StoredVerdict
from railui.desk.widgets.table import Column
from railui.report.loop.wording import VERDICT_LABELS

ERRORS: Final = {"declared": "nominal", "before": "calibrated", "after": "final", "floor": "noise"}


@dataclass(frozen=True)
class LoopOptions:
    """Options of a loop that starts later, as of `LoopPanel.start`."""

    campaign: Campaign | None = None
    correct: bool = False
    accept: bool = False


@dataclass(eq=False)
class CampaignEntry:
    """Campaign of the list with its loop.

    is_written: its report was written; is_waiting: its loop starts later, with these options.
    """

    campaign: Campaign
    history: LoopHistory = field(default_factory=LoopHistory)
    is_written: bool = False
    is_waiting: bool = False
    options: LoopOptions = LoopOptions()

    @property
    def path(self) -> Path:
        """File of the campaign."""
        return self.campaign.source.resolve()

    @property
    def is_at_risk(self) -> bool:
        """True with a verdict whose report was not written."""
        return self.history.finished is not None and not self.is_written

    def stored_verdict(self) -> StoredVerdict | None:
        """Return the verdict with what its panes show; None before the verdict."""
        history = self.history
        if history.finished is None:
            return None
        return StoredVerdict(
            history.finished, list(history.lines), dict(history.errors), dict(history.totals), history.iteration,
            list(history.findings), list(history.rankings),
        )  # fmt: skip

    @classmethod
    def restored(cls, stored: StoredVerdict) -> CampaignEntry:
        """Return the campaign of a stored verdict."""
        dataset = stored.finished.result.dataset
        history = LoopHistory(dataset.campaign)
        history.dataset, history.findings = dataset, stored.findings
        history.errors, history.totals = dict(stored.errors), dict(stored.totals)
        history.lines, history.iteration = list(stored.lines), stored.iteration
        history.rankings = list(stored.rankings) or history.rankings
        history.finished = stored.finished
        return cls(dataset.campaign, history)


def state_text(entry: CampaignEntry, is_running: bool) -> str:
    """Return the state of a campaign in a few words."""
    history = entry.history
    if is_running:
        return "running"
    if entry.is_waiting:
        return "waiting"
    if history.finished is not None:
        return VERDICT_LABELS[history.finished.report["verdict"]]
    if history.stopped is not None:
        return VERDICT_LABELS["data"]
    serious = sum(finding.serious for finding in history.findings)
    return f"{serious} serious data fault{'s' if serious > 1 else ''}" if serious else history.activity or "no verdict"


def campaign_columns(entries: Sequence[CampaignEntry], running: CampaignEntry | None) -> list[Column]:
    """Return the table of the campaigns: name, state, errors, share explained, effects."""
    if not entries:
        return []
    states = tuple(state_text(entry, entry is running) for entry in entries)
    columns = [
        _text_column("campaign", tuple(entry.campaign.name for entry in entries)),
        _text_column("state", states),
    ]
    for key, title in ERRORS.items():
        values = tuple(entry.history.totals.get(key, float("nan")) for entry in entries)
        cells = tuple(error_text(v) if key in e.history.totals else "–" for v, e in zip(values, entries, strict=True))
        columns.append(Column((title,), (title[:7],), cells, values))
    reports = [entry.history.finished.report if entry.history.finished else None for entry in entries]
    explained = tuple(_explained(report) for report in reports)
    cells = tuple("–" if value is None else f"{100 * value:.1f} %" for value in explained)
    columns.append(Column(("explained",), ("expl.",), cells, tuple(-1.0 if v is None else v for v in explained)))
    columns.append(_text_column("effects", tuple(_effects(report) for report in reports)))
    return columns


def _explained(report: dict[str, Any] | None) -> float | None:
    return None if report is None else report["explained"]["value"]


def _effects(report: dict[str, Any] | None) -> str:
    return "" if report is None else "; ".join(candidate_name(row) for row in report["effects"])


def _text_column(title: str, cells: tuple[str, ...]) -> Column:
    order = sorted(set(cells))
    return Column((title,), (title,), cells, tuple(float(order.index(cell)) for cell in cells), is_text=True)
