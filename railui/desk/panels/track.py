"""The Track panel: a track as it lies, its spectrum and its bands, synthetic or measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, Vertical
from textual.events import Resize
from textual.message import Message
from textual.widgets import Static

from railui.arrays import FloatArray
from railui.desk.messages import Failed
from railui.desk.panels.common import arranged, in_turn, titled
from railui.desk.services.ours import files_below
from railui.desk.services.work import Latest
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bar, Bars
from railui.desk.widgets.dialogs import Name, Pick
from railui.desk.widgets.picture import Line, Picture
from railui.desk.widgets.plot import Plot
from railui.ride_quality.track_assessment import assess
from railui.track.excitation import TrackSource, is_track_file, resolve_track
from railui.track.metrics import BANDS, NearestSpectrum, band_sd, nearest_spectrum, psd
from railui.track.spectra import SPECTRA, spectrum_density, spectrum_sd
from railui.vehicle.design_reader import Design

EMPTY = Picture(Axis(""), Axis(""), wait="laying the track")
MM = 1e3
SPEC = "length=2000 seed=1"
PARTS = ("track-line", "stretches", "track-spectrum", "track-bands", "track-cross", "track-gauge")


@dataclass(frozen=True, eq=False)
class Surveyed:
    """A track with its densities [m^2/(rad/m)] over wavenumber [rad/m], its sd [m] per band, what it is nearest to."""

    name: str
    laid: TrackSource
    wavenumber: FloatArray
    density: FloatArray
    bands: FloatArray
    nearest: NearestSpectrum | None


class Assessed(Message):
    """A track was judged by the ride of a vehicle: see `railui.ride_quality.track_assessment`."""

    def __init__(self, vehicle: str, found: dict[str, Any]) -> None:
        super().__init__()
        self.vehicle, self.found = vehicle, found


class Survey(Message):
    """A track was surveyed."""

    def __init__(self, found: Surveyed) -> None:
        super().__init__()
        self.found = found


class TrackPanel(Vertical):
    """What the track is, above; its lines, its spectrum and its bands below."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("o", "choose", "Track or file"),
        Binding("e", "edit", "Edit"),
        Binding("u", "use", "Ride on it"),
        Binding("v", "view(1)", "View"),
        Binding("c", "copy", "Copy", show=False),
    ]
    HELP = """
## Track
`o` chooses one of the known spectra or a file (a track, or the track of a measured run), `e` edits the words of a
synthetic track: `length=2000 seed=1 spacing=0.1 shortest=3 longest=150 scale=1`. `u` lets the design in the form ride
on it. The grey line in the spectrum is the nearest of the known ones; the bands are those of EN 13848. The design in
the form judges the track in stretches of 200 m, worst ride first; behind each stands its place by geometry, 1 the
worst: maintenance should better the ride, not the straightness.
"""

    class Used(Message):
        """The design in the form is to ride on this track."""

        def __init__(self, track: str) -> None:
            super().__init__()
            self.track = track

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.name_of_track = ""
        self.found: Surveyed | None = None
        self.latest, self.judge = Latest(self, "survey"), Latest(self, "assess")
        self.vehicle: tuple[Design, float] | None = None
        self.assessed: dict[str, Any] | None = None
        self.view = 0

    def compose(self) -> ComposeResult:
        yield Static(id="track-told", classes="pane")
        with Grid(id="track-parts"):
            yield Plot(EMPTY, "Lateral deviation", id="track-line", window=(0.0, 0.25))
            yield Plot(EMPTY, "Spectrum, lateral", id="track-spectrum")
            yield Bars("Standard deviation by wavelength", "", id="track-bands")
            yield Bars("Stretches, worst ride first", "needs a design", id="stretches", cursor=True)
            yield Plot(EMPTY, "Cross-level", id="track-cross", window=(0.0, 0.25))
            yield Plot(EMPTY, "Gauge deviation", id="track-gauge", window=(0.0, 0.25))

    def on_mount(self) -> None:
        self.query_one("#track-told").border_title = "Track"

    def begin(self, track: str, vehicle: tuple[Design, float] | None) -> None:
        """The track on which the design rides, where none was chosen here; the design that judges it, its speed."""
        other = vehicle != self.vehicle
        self.vehicle = vehicle
        if not self.name_of_track:
            self.survey(track)
        elif other:
            self._assess()

    def survey(self, track: str) -> None:
        """Lays a track and measures what it contains, in a thread."""
        self.name_of_track = track
        self.latest.ask(partial(_surveyed, track))
        self._assess()

    def _assess(self) -> None:
        if self.vehicle is not None:
            self.judge.ask(partial(_assessed, self.name_of_track, *self.vehicle))

    @on(Assessed)
    def _judged(self, message: Assessed) -> None:
        """A bar per stretch: its score, its class, how far off the order by geometry puts it."""
        self.assessed = message.found
        rows = [
            Bar(
                f"{one['from']:.0f} to {one['to']:.0f}", one["score"] / 100,
                f"{one['score']:4.0f} {one['class'][:14]:14} #{one['rank_geometry']}", strong=i == 0,
            )
            for i, one in enumerate(message.found["stretches"])
        ]  # fmt: skip
        bars = self.query_one("#stretches", Bars)
        bars.show(rows)
        agreement = message.found["agreement"]
        told = "" if agreement is None else f", correlation {agreement:.2f}"
        titled(bars, sub=f"m, score, class, place by geometry{told}")

    @on(Bars.Chosen, "#stretches")
    def _shown(self, event: Bars.Chosen) -> None:
        """The line of the stretch under the cursor."""
        if self.assessed is None or self.found is None:
            return
        one, track = self.assessed["stretches"][event.index], self.found.laid.track
        plot = self.query_one("#track-line", Plot)
        plot.window = ((one["from"] - track.s[0]) / track.length, min(1.0, (one["to"] - track.s[0]) / track.length))
        plot.refresh()

    @on(Survey)
    def _survey(self, message: Survey) -> None:
        self.found = found = message.found
        track = found.laid.track
        text = Text(no_wrap=True, overflow="ellipsis")
        text.append(f"{found.laid.name}\n", "bold")
        text.append(f"{track.length:.6g} m, every {track.spacing:g} m, yw sd {MM * track.yw.std():.3g} mm\n")
        if found.nearest is not None:
            text.append(f"nearest known: {found.nearest.factor:.3g} times {found.nearest.name}", "dim")
        self.query_one("#track-told", Static).update(text, layout=False)
        columns = (("line", "yw", "mm"), ("cross", "phiw", "mrad"), ("gauge", "gauge", "mm"))
        parts = [partial(self._column, found, *one) for one in columns]
        in_turn(self, [*parts, partial(self._spectrum, found), partial(self._bands, found)])

    def _column(self, found: Surveyed, part: str, column: str, unit: str) -> None:
        track = found.laid.track
        y = MM * np.asarray(getattr(track, column))
        flat = not np.any(y)
        wait = "zero: this spectrum has none" if flat else ""
        lines = () if flat else (Line(track.s, y),)
        self.query_one(f"#track-{part}", Plot).show(Picture(Axis("s", "m"), Axis(column, unit), lines, wait=wait))

    def _spectrum(self, found: Surveyed) -> None:
        lines = [Line(found.wavenumber, MM**2 * found.density, "track", "now")]
        if found.nearest is not None:
            known = spectrum_density(found.nearest.name, "yw", found.wavenumber)
            lines.insert(0, Line(found.wavenumber, MM**2 * known, found.nearest.name, "base"))
        x = Axis("wavenumber", "rad/m", log=True, low=0.02, high=10.0)
        self.query_one("#track-spectrum", Plot).show(Picture(x, Axis("S", "mm²/(rad/m)", log=True), lines))

    def _bands(self, found: Surveyed) -> None:
        rows, most = [], float(max(found.bands.max(initial=0.0), 1e-9))
        for (low, high), sd in zip(BANDS, found.bands, strict=True):
            rows.append(Bar(f"{low:g} to {high:g} m", float(sd / most), f"{MM * sd:.3g} mm", strong=True))
            for name in ("erri_b176_low", "erri_b176_high"):
                known = spectrum_sd(name, "yw", low, high)
                rows.append(Bar(f"  {name}", float(known / most), f"{MM * known:.3g} mm", role="base"))
        self.query_one("#track-bands", Bars).show(rows)

    @on(Failed)
    def _failed(self, message: Failed) -> None:
        self.notify(message.text, severity="error", timeout=10)

    def action_choose(self) -> None:
        here = Path.cwd()
        files = [str(p.relative_to(here)) for p in files_below(here, ("*.csv", "*.csv.gz"))]
        known = [(f"{name} {SPEC}", f"{name:16} synthetic") for name in SPECTRA]
        self.app.push_screen(Pick("A spectrum or a file", [*known, *((f, f) for f in files)], free=True), self._chosen)

    def _chosen(self, track: str | None) -> None:
        if track is not None:
            self.survey(track)

    def action_edit(self) -> None:
        self.app.push_screen(Name("Track", self.name_of_track), self._chosen)

    def action_use(self) -> None:
        if self.found is not None:
            self.post_message(self.Used(self.found.name))

    def action_view(self, by: int) -> None:
        self.view = (self.view + by) % len(PARTS)
        self._arrange()

    def on_resize(self, event: Resize) -> None:
        self._arrange()

    def _arrange(self) -> None:
        grid = self.query_one("#track-parts", Grid)
        arranged(grid, [self.query_one(f"#{name}") for name in PARTS], self.view)

    def action_copy(self) -> None:
        self.app.copy_to_clipboard(self.name_of_track)
        self.notify("copied the words of the track", timeout=2)


def _assessed(name: str, design: Design, speed: float) -> Message:
    track = Path(name) if is_track_file(name) else name
    return Assessed(design.name, assess(track, design, speed))


def _surveyed(name: str) -> Message:
    laid = resolve_track(Path(name) if is_track_file(name) else name)
    found = psd(laid.track)
    return Survey(Surveyed(name, laid, found.wavenumber, found.yw, band_sd(laid.track), nearest_spectrum(laid.track)))
