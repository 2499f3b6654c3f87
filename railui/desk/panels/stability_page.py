"""Stability of a design: critical speeds, damping of named modes, root locus, limit cycles."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from textual import on
from textual.app import ComposeResult
from textual.containers import Grid
from textual.geometry import Size
from textual.widgets import Static

from railui.desk.messages import JobDone, ProgressEvent
from railui.desk.panels.common import PLOT_COLUMNS, PLOT_ROWS, Pane, set_titles
from railui.desk.panels.result_pages import ResultPage
from railui.desk.panels.search_layout import Layout, Placed, apply_layout
from railui.desk.presenters.critical_speeds import CriticalSpeeds, critical_key, critical_speeds_text
from railui.desk.presenters.design_results import Comparison
from railui.desk.presenters.stability_plots import cycles_plot, damping_plot, locus_plot, modes_text
from railui.desk.services.jobs import LatestJobRunner, NewestJob
from railui.desk.services.stability_jobs import CriticalSpeedEvent, ModesTracked, compute_critical, track_both
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData

if TYPE_CHECKING:
    from railui.running_stability.mode_tracking import TrackedMode

COMPUTING = PlotData(Axis(""), Axis(""), placeholder="computing")
PARTS = ("damping", "modes", "locus", "cycles")
SLOW_KINDS = ("nonlinear", "ride")
MODE_ROWS = 10  # of the pane of the modes, where there is room for all parts


class StabilityPage(ResultPage):
    """Critical speeds above; damping, modes, root locus and limit cycles below."""

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id)
        self.known = CriticalSpeeds()
        self.computing = ("", "")  # key and kind
        self._sizes: dict[str, Size] = {}  # of the panes, when they were shown last
        self.requested: set[tuple[str, str]] = set()  # keys and kinds of the job
        self.modes: tuple[list[TrackedMode], list[TrackedMode]] | None = None
        self.mode_runner = LatestJobRunner(self, "modes")
        self.critical_job = NewestJob(self, "critical speeds")

    def compose(self) -> ComposeResult:
        yield Pane("Critical speeds", id="critical")
        with Grid(id="stability-parts"):
            yield Plot(COMPUTING, "Damping of the modes", id="damping")
            yield Pane("Modes", id="modes")
            yield Plot(COMPUTING, "Root locus", id="locus")
            yield Plot(COMPUTING, "Limit cycles", id="cycles")

    def show(self, results: Comparison | None) -> None:
        """Show other results: their modes at once, then the critical speeds one by one."""
        is_same = results is not None and self.results is not None and _keys(results) == _keys(self.results)
        self.results = results
        if results is None:
            return
        if not is_same:
            self.modes = None
        self.mode_runner.submit(partial(track_both, results))
        self._draw()
        wanted = [
            (each, kind)
            for each in (results if results[0] is not results[1] else results[:1])
            for kind in SLOW_KINDS
            if kind not in self.known.of(each)
        ]
        names = {(critical_key(each.design, each.conditions.track), kind) for each, kind in wanted}
        if not wanted:
            self.critical_job.cancel()
        elif not (self.critical_job.is_active and names <= self.requested):
            self.requested = names
            self.critical_job.request(lambda job: compute_critical(job, wanted))
        self.set_status("computing critical speeds" if wanted else "")

    def leave(self) -> None:
        self.critical_job.cancel()
        self.set_status("")

    # results of the jobs

    @on(ModesTracked)
    def _on_modes(self, event: ModesTracked) -> None:
        event.stop()
        if self.results is not None and _keys(event.results) == _keys(self.results):
            self.modes = (event.current, event.base if event.results[0] is not event.results[1] else [])
            self._draw()

    @on(ProgressEvent)
    def _on_progress(self, message: ProgressEvent) -> None:
        message.stop()
        event: CriticalSpeedEvent = message.event
        self.computing = (event.key, event.kind)
        if event.result is not None:
            self.known.add(event.key, event.kind, event.result)
            self.computing = ("", "")
        self._draw()

    @on(JobDone)
    def _on_done(self, message: JobDone) -> None:
        message.stop()
        self.set_status("")

    # drawing

    def _draw(self) -> None:
        if self.results is None:
            return
        current, base = self.results
        known = self.known.of(current)
        known_base = None if base is current else self.known.of(base)
        pane = self.query_one("#critical", Static)
        key, kind = self.computing
        computing = kind if key == critical_key(current.design, current.conditions.track) else ""
        width = self._room(pane).width
        pane.update(critical_speeds_text(known, known_base, computing, width), layout=False)
        self.query_one("#cycles", Plot).show(cycles_plot(known, known_base))
        damping, locus, modes = (self.query_one(f"#{name}") for name in ("damping", "locus", "modes"))
        assert isinstance(damping, Plot) and isinstance(locus, Plot) and isinstance(modes, Static)
        speed = current.conditions.speed
        set_titles(modes, f"Modes at {speed:.4g} m/s")
        if self.modes is None:
            damping.show(COMPUTING)
            locus.show(COMPUTING)
            modes.update("", layout=False)
            return
        damping.show(damping_plot(*self.modes, known, speed))
        locus.show(locus_plot(*self.modes, speed))
        size = self._room(modes)
        modes.update(modes_text(*self.modes, speed, damping.style, size.width, size.height), layout=False)

    def _room(self, pane: Static) -> Size:
        """Return the size of a pane; while its page is hidden, the last one."""
        if pane.content_size.area:
            self._sizes[str(pane.id)] = pane.content_size
        return self._sizes.get(str(pane.id), pane.content_size)

    def on_resize(self) -> None:
        self.arrange_parts()
        self.call_after_refresh(self._draw)

    def arrange_parts(self) -> None:
        """Show as many parts as fit, the damping always if there is room for two."""
        grid = self.query_one("#stability-parts", Grid)
        layout = stability_layout(grid.size.width, grid.size.height, self.view)
        apply_layout(grid, {name: self.query_one(f"#{name}") for name in PARTS}, layout)
        self.call_after_refresh(self._draw)


def stability_layout(width: int, height: int, view: int) -> Layout:
    """Return the layout of the parts for an area in cells."""
    if width >= 2 * PLOT_COLUMNS and height >= 2 * PLOT_ROWS + MODE_ROWS:
        parts = (Placed("damping", 2), Placed("locus"), Placed("cycles"), Placed("modes", 2))
        return Layout("1fr 1fr", f"4fr 3fr {MODE_ROWS}", parts)
    if height >= 2 * MODE_ROWS:
        lower = PARTS[1 + view % (len(PARTS) - 1)]
        return Layout("1fr", f"1fr {MODE_ROWS}" if lower == "modes" else "1fr 1fr", (Placed("damping"), Placed(lower)))
    return Layout("1fr", "1fr", (Placed(PARTS[view % len(PARTS)]),))


def _keys(results: Comparison) -> tuple[str, str, float]:
    current, base = (critical_key(each.design, each.conditions.track) for each in results)
    return current, base, results[0].conditions.speed
