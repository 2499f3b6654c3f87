"""Track panel: lines, spectrum and bands of a track, and its sections by ride quality."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid
from textual.message import Message
from textual.widgets import Static

from railui import assess
from railui.desk.messages import JobFailed
from railui.desk.panels.common import COPY, VIEW, Pane, Panel, arrange_grid, draw_in_turn, set_titles
from railui.desk.presenters.choices import find_files
from railui.desk.presenters.track_analysis import (
    TrackAnalysis,
    analyse_track,
    band_rows,
    column_plot,
    resolve_named_track,
    section_caption,
    section_rows,
    section_window,
    spectrum_plot,
    summary_text,
)
from railui.desk.services.jobs import LatestJobRunner
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.dialogs import ChoiceDialog, InputDialog
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData
from railui.track.spectra import SPECTRA
from railui.vehicle.design_reader import Design

NO_PLOT = PlotData(Axis(""), Axis(""), placeholder="loading the track")
INITIAL_WINDOW = (0.0, 0.25)  # fraction of the track shown before zooming
DEFAULT_SPEC = "length=2000 seed=1"
PARTS = ("track-line", "sections", "track-spectrum", "track-bands", "track-cross", "track-gauge")
COLUMNS = (("track-line", "yw", "mm"), ("track-cross", "phiw", "mrad"), ("track-gauge", "gauge", "mm"))


class TrackAssessed(Message):
    """Assessment of a track by a vehicle: see `railui.ride_quality.track_assessment`."""

    def __init__(self, track: str, vehicle: str, result: dict[str, Any]) -> None:
        super().__init__()
        self.track = track
        self.vehicle = vehicle
        self.result = result


class TrackAnalysed(Message):
    """Analysis of a track."""

    def __init__(self, analysis: TrackAnalysis) -> None:
        super().__init__()
        self.analysis = analysis


class TrackPanel(Panel):
    """Summary of the track above; its lines, spectrum, bands and sections below."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("o", "choose", "Track or file"),
        Binding("e", "edit", "Edit", tooltip="change the spec of the track"),
        Binding("u", "use", "Use track", tooltip="run the design in the form on this track"),
        VIEW,
        COPY,
    ]
    HELP = """
## Track
`o` chooses a standard spectrum or a file (a track, or the track of a measured run), `e` edits the spec of a synthetic
track: `length=2000 seed=1 spacing=0.1 shortest=3 longest=150 scale=1`. `u` uses the track in the Design panel.
The grey line in the spectrum is the nearest standard spectrum; the bands are D1, D2 and part of D3 of EN 13848. Track
sections of 200 m are ranked by the ride quality of the design in the form, worst first, with their rank by geometry (1:
worst): maintenance should improve the vehicle response rather than the geometry alone.
"""

    class TrackChosen(Message):
        """Request to use this track in the Design panel."""

        def __init__(self, track: str) -> None:
            super().__init__()
            self.track = track

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.track_name = ""
        self.is_chosen_here = False  # and not the track of the form
        self.analysis: TrackAnalysis | None = None
        self.analysis_runner = LatestJobRunner(self, "analysis")
        self.assessment_runner = LatestJobRunner(self, "assessment")
        self.vehicle: tuple[Design, float] | None = None
        self.assessment: dict[str, Any] | None = None

    def compose(self) -> ComposeResult:
        yield Pane("Track", id="track-summary")
        with Grid(id="track-parts"):
            yield Plot(NO_PLOT, "Lateral deviation", id="track-line", window=INITIAL_WINDOW)
            yield Plot(NO_PLOT, "Spectrum, lateral", id="track-spectrum")
            yield Bars("Standard deviation by wavelength", "", id="track-bands")
            yield Bars("Sections, worst ride first", "needs a design", id="sections", has_cursor=True)
            yield Plot(NO_PLOT, "Cross-level", id="track-cross", window=INITIAL_WINDOW)
            yield Plot(NO_PLOT, "Gauge deviation", id="track-gauge", window=INITIAL_WINDOW)

    # analysis

    def show_for(self, track: str, vehicle: tuple[Design, float] | None) -> None:
        """Show a track unless another one was chosen here, assessed by a design at a speed [m/s]."""
        has_changed = vehicle != self.vehicle
        self.vehicle = vehicle
        if track == self.track_name:
            self.is_chosen_here = False  # the form has it too
        if track != self.track_name and not self.is_chosen_here:
            self.analyse(track)
        elif has_changed:
            self._assess()

    def analyse(self, track: str) -> None:
        """Analyse and assess a track on a thread."""
        self.track_name = track
        self.assessment = None
        bars = self.query_one("#sections", Bars)
        bars.show([])
        set_titles(bars, sub="")
        self.analysis_runner.submit(partial(_analysed, track))
        self._assess()

    def _assess(self) -> None:
        if self.vehicle is not None:
            self.assessment_runner.submit(partial(_assessed, self.track_name, *self.vehicle))

    @on(TrackAssessed)
    def _on_assessed(self, message: TrackAssessed) -> None:
        if message.track != self.track_name:
            return  # that of the track before
        self.assessment = message.result
        bars = self.query_one("#sections", Bars)
        bars.show(section_rows(message.result))
        set_titles(bars, sub=section_caption(message.result))

    @on(TrackAnalysed)
    def _on_analysed(self, message: TrackAnalysed) -> None:
        self.analysis = analysis = message.analysis
        self.query_one("#track-summary", Static).update(summary_text(analysis), layout=False)
        lines = [partial(self._show_column, analysis, *column) for column in COLUMNS]
        draw_in_turn(self, [*lines, partial(self._show_spectrum, analysis), partial(self._show_bands, analysis)])

    @on(JobFailed)
    def _on_failed(self, message: JobFailed) -> None:
        self.notify(message.text, severity="error", timeout=10)

    # drawing

    def _show_column(self, analysis: TrackAnalysis, part: str, column: str, unit: str) -> None:
        self.query_one(f"#{part}", Plot).show(column_plot(analysis, column, unit))

    def _show_spectrum(self, analysis: TrackAnalysis) -> None:
        self.query_one("#track-spectrum", Plot).show(spectrum_plot(analysis))

    def _show_bands(self, analysis: TrackAnalysis) -> None:
        self.query_one("#track-bands", Bars).show(band_rows(analysis))

    @on(Bars.RowSelected, "#sections")
    def _on_section_selected(self, event: Bars.RowSelected) -> None:
        """Show the lateral deviation of the section under the cursor."""
        if self.assessment is None or self.analysis is None:
            return
        plot = self.query_one("#track-line", Plot)
        plot.window = section_window(self.analysis, self.assessment["stretches"][event.index])
        plot.refresh()

    def arrange_parts(self) -> None:
        """Show as many parts as fit."""
        grid = self.query_one("#track-parts", Grid)
        arrange_grid(grid, [self.query_one(f"#{name}") for name in PARTS], self.view)

    # actions

    def action_choose(self) -> None:
        directory = Path.cwd()
        files = [str(p.relative_to(directory)) for p in find_files(directory, ("*.csv", "*.csv.gz"))]
        spectra = [(f"{name} {DEFAULT_SPEC}", f"{name:16} synthetic") for name in SPECTRA]
        choices = [*spectra, *((file, file) for file in files)]
        self.app.push_screen(ChoiceDialog("Choose a spectrum or a file", choices, free=True), self._on_track_chosen)

    def _on_track_chosen(self, track: str | None) -> None:
        if track is not None:
            self.is_chosen_here = True
            self.analyse(track)

    def action_edit(self) -> None:
        self.app.push_screen(InputDialog("Track", self.track_name), self._on_track_chosen)

    def action_use(self) -> None:
        if self.analysis is not None:
            self.post_message(self.TrackChosen(self.analysis.name))

    def action_copy(self) -> None:
        self.app.copy_to_clipboard(self.track_name)
        self.notify("track copied", timeout=2)


def _assessed(name: str, design: Design, speed: float) -> Message:
    return TrackAssessed(name, design.name, assess(resolve_named_track(name), design, speed))


def _analysed(name: str) -> Message:
    return TrackAnalysed(analyse_track(name))
