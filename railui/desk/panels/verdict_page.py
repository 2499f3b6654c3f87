"""Verdict of a loop: stages, sentence, shares of the error, rivals, next runs, rankings, evidence."""

from __future__ import annotations

from typing import Final

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Grid, Vertical, VerticalScroll
from textual.widgets import Static

from railui.desk.panels.common import PLOT_COLUMNS, Pane, set_titles
from railui.desk.panels.search_layout import Layout, Placed, apply_layout
from railui.desk.presenters.loop_history import LoopHistory
from railui.desk.presenters.loop_text import evidence_text, identifiability_summary, multiple_shooting_note
from railui.desk.presenters.verdict_rows import (
    explained_text,
    next_run_rows,
    no_next_run_text,
    ranking_count,
    ranking_page,
    rival_rows,
    share_rows,
)
from railui.desk.presenters.verdict_stages import loop_stages, stages_text
from railui.desk.widgets.bars import Bars
from railui.report.loop.wording import VERDICT_LABELS

SHARES, RIVALS, NEXT, KEPT, EVIDENCE = "shares", "rivals", "next-runs", "rankings", "evidence"
PARTS: Final = (SHARES, RIVALS, NEXT, KEPT, EVIDENCE)
SHARE_ROWS: Final = 6  # with border
RIVAL_ROWS: Final = 5
NEXT_ROWS: Final = 5
NARROW_COLUMNS: Final = 50
BADGE_STYLES: Final = {"none": "bold reverse green", "effect": "bold reverse", "data": "bold reverse red"}


class VerdictPage(Vertical):
    """Page with everything on which a verdict rests."""

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id)
        self.history = LoopHistory()
        self.is_computing = False
        self.view = 0
        self.ranking = 0  # number of the ranking that is shown

    def compose(self) -> ComposeResult:
        yield Pane("Stages, NRMSE on the validation runs", id="stages")
        yield Pane("Verdict", id="verdict-sentence")
        with Grid(id="verdict-parts"):
            yield Bars("Squared validation error", "after the verdict", id=SHARES)
            yield Bars("Rival models", "after the verdict", id=RIVALS)
            yield Bars("Next run", "after the verdict", id=NEXT)
            yield Bars("Rankings", "no score test yet", id=KEPT)
            with VerticalScroll(id=EVIDENCE, classes="pane"):
                yield Static(id="evidence-text")

    def on_mount(self) -> None:
        set_titles(self.query_one(f"#{EVIDENCE}"), "Evidence")

    def show(self, history: LoopHistory, is_running: bool) -> None:
        """Show a loop."""
        if history is not self.history:
            self.ranking = 0
        self.history, self.is_computing = history, is_running
        if self.display:
            self.draw()

    def draw(self) -> None:
        """Draw every part."""
        self._draw_head()
        self._draw_rows()
        self._draw_ranking()

    def _draw_head(self) -> None:
        stages = self.query_one("#stages", Static)
        is_plain = bool(getattr(self.app, "is_plain", False))
        shown = loop_stages(self.history, self.is_computing)
        stages.update(stages_text(shown, stages.content_size.width, is_plain), layout=False)
        pane = self.query_one("#verdict-sentence", Static)
        pane.update(verdict_text(self.history, self.is_computing))
        finished = self.history.finished
        set_titles(pane, sub=identifiability_summary(finished.report) if finished else "")

    def _draw_rows(self) -> None:
        finished, history = self.history.finished, self.history
        shares, rivals, runs = (self.query_one(f"#{name}", Bars) for name in (SHARES, RIVALS, NEXT))
        shares.show(share_rows(history))
        set_titles(shares, sub=explained_text(finished.report) if finished else "")
        rivals.placeholder = "no rival was fitted" if finished else "after the verdict"
        rivals.show(rival_rows(finished) if finished else [])
        set_titles(rivals, sub="Vuong's z for the final model ┃ 5 %" if finished else "")
        runs.placeholder = no_next_run_text(finished.report) if finished else "after the verdict"
        runs.show(next_run_rows(finished.report) if finished else [])
        runs.refresh()
        set_titles(runs, sub="probability to separate the rivals" if finished and runs.rows else "")
        text = evidence_text(finished.report) if finished else Text("after the verdict", "dim")
        self.query_one("#evidence-text", Static).update(text)

    def _draw_ranking(self) -> None:
        bars = self.query_one(f"#{KEPT}", Bars)
        count = ranking_count(self.history)
        self.ranking %= max(1, count)
        title, rows = ranking_page(self.history, self.ranking, bars.size.width < NARROW_COLUMNS)
        bars.show(rows)
        bars.refresh()
        set_titles(bars, title, f"r next of {count}" if count > 1 else "")

    def show_next_ranking(self) -> None:
        """Show the next ranking."""
        self.ranking += 1
        if not self.query_one(f"#{KEPT}").display:
            self.view = next((i for i, names in enumerate(self._low_views()) if KEPT in names), 0)
            self.arrange_parts()
        self._draw_ranking()

    def on_resize(self) -> None:
        self.arrange_parts()
        self.call_after_refresh(self.draw)

    def on_show(self) -> None:
        self.draw()

    # layout

    def _low_views(self) -> list[tuple[str, ...]]:
        height = self.query_one("#verdict-parts").size.height
        first = (SHARES, RIVALS, NEXT) if height >= SHARE_ROWS + RIVAL_ROWS + NEXT_ROWS else (SHARES, RIVALS)
        others = [(name,) for name in (NEXT, KEPT, EVIDENCE) if name not in first]
        return [first, *others]

    def arrange_parts(self) -> None:
        """Show as many parts as fit."""
        grid = self.query_one("#verdict-parts", Grid)
        width, height = grid.size.width, grid.size.height
        if width >= 2 * PLOT_COLUMNS and height >= SHARE_ROWS + RIVAL_ROWS + NEXT_ROWS + 6:
            rows = f"{SHARE_ROWS} {RIVAL_ROWS} {NEXT_ROWS} 1fr"
            parts = (Placed(SHARES), Placed(KEPT, rows=4), Placed(RIVALS), Placed(NEXT), Placed(EVIDENCE))
            layout = Layout("1fr 1fr", rows, parts)
        else:
            names = self._low_views()[self.view % len(self._low_views())]
            fixed = {SHARES: str(SHARE_ROWS), RIVALS: str(RIVAL_ROWS)} if len(names) > 1 else {}
            heights = [*(fixed.get(name, "1fr") for name in names[:-1]), "1fr"]
            layout = Layout("1fr", " ".join(heights), tuple(Placed(name) for name in names))
        apply_layout(grid, {name: self.query_one(f"#{name}") for name in PARTS}, layout)


def verdict_text(history: LoopHistory, is_running: bool) -> Text:
    """Return the verdict: its label and sentence, or the activity of the loop."""
    if history.finished is not None:
        return _labelled(history.finished.report["verdict"], _sentence(history.finished.report))
    if history.stopped is not None and not is_running:
        return _labelled("data", history.activity)
    text = history.activity or ("reading the runs" if is_running else "No verdict yet: s starts the loop.")
    return Text(text, "dim")


def _sentence(report: dict[str, object]) -> str:
    return f"{report['sentence']} {multiple_shooting_note(report)}".strip()


def _labelled(verdict: str, sentence: str) -> Text:
    text = Text(f" {VERDICT_LABELS[verdict].upper()} ", BADGE_STYLES.get(verdict, "bold reverse yellow"))
    return Text.assemble(text, "\n", sentence)
