"""Schematic of the vehicle with a mode or the ride animated."""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np
from textual import on
from textual.app import ComposeResult
from textual.containers import Grid
from textual.timer import Timer

from railui.desk.panels.common import PLOT_ROWS, set_titles
from railui.desk.panels.result_pages import ResultPage
from railui.desk.panels.search_layout import Layout, Placed, apply_layout
from railui.desk.presenters.design_results import Comparison, DesignResults
from railui.desk.presenters.schematic import (
    CYCLE_POINTS,
    CYCLE_SECONDS,
    DRAWN_MOTION,
    RIDE_SLOWNESS,
    at_sample,
    cycle_plot,
    largest_motion,
    mode_motion,
    ride_plot,
    schematic_plot,
)
from railui.desk.presenters.stability_plots import shown_modes
from railui.desk.services.jobs import LatestJobRunner
from railui.desk.services.motion_jobs import MotionComputed, VehicleMotion, compute_motion
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData

if TYPE_CHECKING:
    from railui.running_stability.mode_tracking import TrackedMode

FRAME_INTERVAL: Final = 0.125  # s between two pictures
COMPUTING: Final = PlotData(Axis(""), Axis(""), placeholder="computing")


class VehiclePage(ResultPage):
    """Vehicle from above; below, the motion of its bodies over time."""

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id)
        self.motion: VehicleMotion | None = None
        self._shown: DesignResults | None = None  # whose motion it is
        self.seconds = 0.0  # of the picture
        self.is_playing = True
        self._runner = LatestJobRunner(self, "motion")
        self._timer: Timer | None = None
        self._last_frame = 0.0

    def compose(self) -> ComposeResult:
        with Grid(id="vehicle-parts"):
            yield Plot(COMPUTING, "Vehicle", id="schematic")
            yield Plot(COMPUTING, "Motion", id="motion")

    def show(self, results: Comparison | None) -> None:
        """Show another design; the last picture stays until its motion is known."""
        self.results = results
        if results is None:
            return
        if self._shown is not results[0]:
            self._runner.submit(partial(compute_motion, results[0]))
        if self._timer is None:
            self.is_playing = self.app.animation_level != "none"
            self._timer = self.set_interval(FRAME_INTERVAL, self._tick)
            self._last_frame = time.monotonic()

    def leave(self) -> None:
        if self._timer is not None:
            self._timer.stop()
            self._timer = None
        self.set_status("")

    def toggle(self) -> None:
        """Play or pause."""
        self.is_playing = not self.is_playing
        self.draw()

    @on(MotionComputed)
    def _on_motion(self, message: MotionComputed) -> None:
        message.stop()
        if self.results is not None and message.results is self.results[0]:
            self.motion, self._shown = message.motion, message.results
            self.draw()

    @property
    def modes(self) -> list[TrackedMode]:
        """Modes that oscillate at the speed of the form."""
        if self.motion is None or self.results is None:
            return []
        speed = self.results[0].conditions.speed
        found = shown_modes(self.motion.modes)
        return [mode for mode in found if mode.oscillates[int(np.argmin(np.abs(mode.speeds - speed)))]]

    @property
    def mode(self) -> TrackedMode | None:
        """Mode that is shown; None for the ride, which comes after the last mode."""
        modes = self.modes
        number = self.view % (len(modes) + 1)
        return modes[number] if number < len(modes) else None

    # drawing

    def _tick(self) -> None:
        now = time.monotonic()
        passed, self._last_frame = now - self._last_frame, now
        is_seen = all(node.display for node in self.ancestors_with_self)
        if self.is_playing and is_seen and self.app.screen is self.screen:
            self.seconds += passed
            self.draw()

    def draw(self) -> None:
        """Draw the vehicle at the present time of the picture."""
        if self.motion is None or self.results is None:
            return
        mode = self.mode
        if mode is None:
            self._draw_ride(self.motion)
        else:
            self._draw_mode(self.motion, mode, self.results[0].conditions.speed)
        self.set_status("" if self.is_playing else "paused")

    def _draw_mode(self, known: VehicleMotion, mode: TrackedMode, speed: float) -> None:
        motion = mode_motion(mode, speed)
        phase = self.seconds / CYCLE_SECONDS % 1.0
        factor = DRAWN_MOTION / (largest_motion(known.parts, motion) or 1.0)
        now = at_sample(motion, round(phase * (CYCLE_POINTS - 1)))
        i = int(np.argmin(np.abs(mode.speeds - speed)))
        frequency, damping = float(mode.frequency[i]), float(mode.damping[i])
        upper, lower = self.query_one("#schematic", Plot), self.query_one("#motion", Plot)
        upper.show(schematic_plot(known.parts, now, factor))
        lower.show(cycle_plot(motion, phase, frequency))
        number = f"mode {self.view % (len(self.modes) + 1) + 1} of {len(self.modes)}"
        set_titles(upper, f"{mode.name} at {speed:.4g} m/s", f"{number} · v next · p pause")
        set_titles(lower, "A cycle without its decay", f"{frequency:.2f} Hz, damping {damping:.3f}")

    def _draw_ride(self, known: VehicleMotion) -> None:
        duration = float(known.t[-1] - known.t[0])
        now = float(known.t[0]) + (self.seconds / RIDE_SLOWNESS) % max(duration, 1e-9)
        i = int(np.searchsorted(known.t, now))
        factor = DRAWN_MOTION / (largest_motion(known.parts, known.ride) or 1.0)
        extent = max(abs(part.x) + part.half_length for part in known.parts) + 0.6
        place = float(known.s[min(i, len(known.s) - 1)])
        x = np.linspace(-extent, extent, 60)
        leading = max(part.x for part in known.parts if part.is_wheelset)  # s is that of the leading wheelset
        rails = np.array([x, np.interp(place + x - leading, known.s, known.track)])
        upper, lower = self.query_one("#schematic", Plot), self.query_one("#motion", Plot)
        upper.show(schematic_plot(known.parts, at_sample(known.ride, min(i, len(known.t) - 1)), factor, rails))
        lower.show(ride_plot(known.t, known.ride, known.track, now))
        set_titles(upper, f"Ride at {place:.0f} m", f"lateral motion × {factor:.3g} · v modes · p pause")
        set_titles(lower, "Lateral displacement", f"{now:.1f} s, {RIDE_SLOWNESS:g} times slower")

    def on_resize(self) -> None:
        self.arrange_parts()

    def arrange_parts(self) -> None:
        """Show the motion over time where there is room for it."""
        grid = self.query_one("#vehicle-parts", Grid)
        parts = {name: self.query_one(f"#{name}") for name in ("schematic", "motion")}
        has_room = grid.size.height >= 2 * PLOT_ROWS - 2
        rows, names = ("3fr 2fr", ("schematic", "motion")) if has_room else ("1fr", ("schematic",))
        apply_layout(grid, parts, Layout("1fr", rows, tuple(Placed(name) for name in names)))
        self.draw()
