"""Maps of the ride quality over two parameters, or over a parameter and the speed."""

from __future__ import annotations

from dataclasses import dataclass

from textual import on
from textual.app import ComposeResult
from textual.message import Message

from railui.api.map_rows import SPEED
from railui.desk.messages import JobDone, ProgressEvent
from railui.desk.panels.common import set_titles
from railui.desk.panels.result_pages import ResultPage
from railui.desk.presenters.design_results import Comparison, DesignResults
from railui.desk.presenters.map_text import (
    QUANTITIES,
    DesignMap,
    MapAxis,
    axis_choices,
    first_parameter,
    map_data,
    map_key,
    parameter_axis,
    speeds_axis,
)
from railui.desk.services.jobs import NewestJob
from railui.desk.services.map_jobs import MapRow, compute_map
from railui.desk.widgets.dialogs import ChoiceDialog
from railui.desk.widgets.heat_map import HeatMap, MapData

MAX_MAPS = 16  # that are kept
HINT = "● this design · enter sets the values · v quantity"
SHORT_HINT = "● this design · v quantity"


class MapPage(ResultPage):
    """A map, its axes and its quantity."""

    @dataclass
    class ValuesChosen(Message):
        """Values under the cursor of the map, by path; the speed is `speed`."""

        values: dict[str, float]

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id)
        self.maps: dict[str, DesignMap] = {}
        self.axes: dict[str, MapAxis] = {}  # x and y
        self.requested = ""
        self.map_job = NewestJob(self, "map")

    def compose(self) -> ComposeResult:
        yield HeatMap("Map", id="map-picture")

    @property
    def quantity(self) -> str:
        """Key of the quantity shown."""
        return list(QUANTITIES)[self.view % len(QUANTITIES)]

    @property
    def current(self) -> DesignMap | None:
        """Map that is shown."""
        return self.maps.get(self.requested)

    def show(self, results: Comparison | None) -> None:
        """Show the map of other results; it is computed if it is not known."""
        self.results = results
        if results is None or not self._has_axes(results[0]):
            self.requested = ""
            return
        x, y = self.axes["x"], self.axes["y"]
        key = map_key(results[0], x, y)
        known = self.maps.get(key)
        if known is not None and known.is_complete:
            self.map_job.cancel()
        elif known is None or not (self.map_job.is_active and key == self.requested):
            self._request(key, DesignMap(x, y), results[0])
        self.requested = key
        self.draw()

    def _request(self, key: str, wanted: DesignMap, current: DesignResults) -> None:
        """Compute a map anew; rows of an earlier job that still arrive belong to the map before."""
        self.maps[key] = wanted
        while len(self.maps) > MAX_MAPS:
            del self.maps[next(iter(self.maps))]
        self.map_job.request(lambda job: compute_map(job, wanted, current))

    def _has_axes(self, results: DesignResults) -> bool:
        """Choose axes that are missing, or whose parameter the design lacks or has beyond the ends of the axis."""
        design = results.design
        for name in ("x", "y"):
            axis = self.axes.get(name)
            if axis is not None and axis.path != SPEED and not _contains(axis, results):
                del self.axes[name]
                if axis.path in design.paths() and (fresh := parameter_axis(design, axis.path)) is not None:
                    self.axes[name] = fresh
        if "y" not in self.axes:
            self.axes["y"] = speeds_axis()
        if "x" not in self.axes:
            path = first_parameter(design)
            fresh = None if path is None else parameter_axis(design, path)
            if fresh is None:
                self.set_status("no spring and no damper above 0")
                return False
            self.axes["x"] = fresh
        return True

    def leave(self) -> None:
        self.map_job.cancel()
        self.set_status("")

    def ask_axis(self, name: str) -> None:
        """Ask for the parameter of an axis."""
        if self.results is None:
            return
        choices = axis_choices(self.results[0].design)
        if name == "y":
            choices = [(SPEED, f"{SPEED:44} of the run, from 20 to 80 m/s"), *choices]
        title = "Parameter to the right" if name == "x" else "Speed or parameter upwards"
        self.app.push_screen(ChoiceDialog(title, choices), lambda path: self._set_axis(name, path))

    def _set_axis(self, name: str, path: str | None) -> None:
        if path is None or self.results is None:
            return
        axis = speeds_axis() if path == SPEED else parameter_axis(self.results[0].design, path)
        if axis is None:
            return
        other = self.axes.get("y" if name == "x" else "x")
        if other is not None and other.path == path:
            self.notify(f"{axis.name} is on the other axis", severity="warning")
            return
        self.axes[name] = axis
        self.show(self.results)

    # results

    @on(ProgressEvent)
    def _on_progress(self, message: ProgressEvent) -> None:
        message.stop()
        event: MapRow = message.event
        event.map.rows.append(event.values)
        if event.map is self.current:
            self.draw()

    @on(JobDone)
    def _on_done(self, message: JobDone) -> None:
        message.stop()
        self.draw()

    @on(HeatMap.Taken)
    def _on_taken(self, message: HeatMap.Taken) -> None:
        message.stop()
        self.post_message(self.ValuesChosen({self.axes["x"].path: message.x, self.axes["y"].path: message.y}))

    # drawing

    def draw(self) -> None:
        """Draw the map."""
        known = self.current
        if known is None or self.results is None:
            return
        picture = self.query_one(HeatMap)
        data: MapData = map_data(known, self.quantity, self.results[0])
        picture.show(data)
        set_titles(picture, data.title, HINT if picture.size.width > len(HINT) + 2 else SHORT_HINT)
        self.set_status("" if known.is_complete else f"row {len(known.rows) + 1} of {len(known.y.axis.values)}")

    def arrange_parts(self) -> None:
        """Show the quantity that `view` has chosen."""
        self.draw()


def _contains(axis: MapAxis, results: DesignResults) -> bool:
    """Return True if the design's value is within the ends of an axis."""
    values = axis.axis.values
    return axis.path in results.design.paths() and values[0] <= results.design.value(axis.path) <= values[-1]
