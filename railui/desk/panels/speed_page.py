"""Ride quality of a design over speed with a band over track seeds."""

from __future__ import annotations

from textual import on
from textual.app import ComposeResult
from textual.containers import Grid

from railui.desk.messages import JobDone, ProgressEvent
from railui.desk.panels.common import arrange_grid, set_titles
from railui.desk.panels.result_pages import ResultPage
from railui.desk.presenters.critical_speeds import CriticalSpeeds
from railui.desk.presenters.design_results import Comparison
from railui.desk.presenters.speed_bands import (
    BAND_SPEEDS,
    PLOT_TITLES,
    SEED_COUNT,
    SpeedBand,
    band_key,
    band_plot,
    band_text,
)
from railui.desk.services.jobs import NewestJob
from railui.desk.services.speed_jobs import SeedSimulated, compute_bands
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData

WAITING = PlotData(Axis(""), Axis(""), placeholder="simulating")
MAX_BANDS = 32  # that are kept


class SpeedPage(ResultPage):
    """Plots of the ride quality against speed."""

    def __init__(self, known: CriticalSpeeds, *, id: str) -> None:
        """Create the page; known: critical speeds, which are drawn where they are known."""
        super().__init__(id=id)
        self.known = known
        self.bands: dict[str, SpeedBand] = {}
        self.requested: set[str] = set()
        self.band_job = NewestJob(self, "rides over speed")

    def compose(self) -> ComposeResult:
        with Grid(id="speed-parts"):
            for key, title in PLOT_TITLES.items():
                yield Plot(WAITING, title, id=f"band-{key}")

    def show(self, results: Comparison | None) -> None:
        """Show other results; what is not known yet is simulated."""
        self.results = results
        if results is None:
            return
        self._draw()
        each = results if results[0] is not results[1] else results[:1]
        wanted = [one for one in each if not self._band(band_key(one)).is_complete]
        keys = {band_key(one) for one in wanted}
        if not wanted:
            self.band_job.cancel()
        elif not (self.band_job.is_active and keys <= self.requested):
            self.requested = keys
            done = {key: self._band(key).count for key in keys}
            self.band_job.request(lambda job: compute_bands(job, wanted, done))
        self._show_status()

    def leave(self) -> None:
        self.band_job.cancel()
        self.set_status("")

    def _band(self, key: str) -> SpeedBand:
        if key not in self.bands:
            self.bands[key] = SpeedBand(BAND_SPEEDS)
            while len(self.bands) > MAX_BANDS:
                del self.bands[next(iter(self.bands))]
        return self.bands[key]

    @on(ProgressEvent)
    def _on_progress(self, message: ProgressEvent) -> None:
        message.stop()
        event: SeedSimulated = message.event
        band = self._band(event.key)
        if event.number == band.count:  # a stopped job may deliver a seed that is known
            band.add(event.rides)
            band.is_complete = event.is_last
        self._draw()
        self._show_status()

    @on(JobDone)
    def _on_done(self, message: JobDone) -> None:
        message.stop()
        self._show_status()

    def _show_status(self) -> None:
        if self.results is None:
            return
        each = self.results if self.results[0] is not self.results[1] else self.results[:1]
        bands = [self._band(band_key(one)) for one in each]
        if all(band.is_complete for band in bands):
            self.set_status("" if bands[0].count > 1 else "track file: no seeds, no band")
        else:
            self.set_status(f"seed {min(SEED_COUNT, bands[0].count + 1)} of {SEED_COUNT}")

    def _draw(self) -> None:
        if self.results is None:
            return
        current, base = self.results
        bands = self._band(band_key(current)), None if base is current else self._band(band_key(base))
        for key in PLOT_TITLES:
            data = band_plot(key, *bands, self.known.of(current), current.conditions.speed)
            plot = self.query_one(f"#band-{key}", Plot)
            plot.show(data)
            set_titles(plot, sub=band_text(key, bands[0], current.conditions.speed))

    def on_resize(self) -> None:
        self.arrange_parts()

    def arrange_parts(self) -> None:
        """Show as many plots as fit."""
        plots = [self.query_one(f"#band-{key}") for key in PLOT_TITLES]
        arrange_grid(self.query_one("#speed-parts", Grid), plots, self.view)
