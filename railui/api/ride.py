"""Ride quality of a design on a track at a speed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Final

from railui.api.design import Design
from railui.api.display import SummaryRow, draw_on, shown_value
from railui.api.result import DesignResult, input_paths
from railui.api.series import Series, simulate_design
from railui.io.problems import suggest_name

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

    from railui.report.ride.figures import RidePanels
    from railui.ride_quality.evaluation import TrackLike
    from railui.track.excitation import Excitation
    from railui.vehicle.resolve import ModelSource

UNITS: Final[Mapping[str, str]] = {
    "score": "1",
    "comfort_hours": "h",
    "weighted_acceleration": "m/s^2",
    "weighted_acceleration_1974": "m/s^2",
    "flange_fraction": "1",
    "flange_fraction_gaussian": "1",
    "flange_margin": "1",
    "n_mv": "1",
    "wz": "1",
}


@dataclass(frozen=True, eq=False)
class Ride(DesignResult):
    """Ride quality of a design on a track; `Design.ride` computes it.

    Attributes
    ----------
    design : Design
    data : mapping
        The result of `railui.ride`.
    excitation : Excitation
        Track at the speed.

    Examples
    --------
    >>> ride = Design.load("designs/test_bogie.yaml").ride("erri_b176_low length=500", 40.0)
    >>> ride.decided_by, ride.units["weighted_acceleration"]
    ('reduced comfort after 2.21 h, within the journey of 4 h', 'm/s^2')
    """

    COMMAND: ClassVar[str] = "ride"
    units: ClassVar[Mapping[str, str]] = UNITS

    excitation: Excitation = field(repr=False, kw_only=True)

    @property
    def speed(self) -> float:
        """Speed [m/s]."""
        return float(self.data["speed"])

    @property
    def track(self) -> str:
        """Name of the track."""
        return str(self.data["track"])

    @property
    def score(self) -> float:
        """Score of the ride, 0 to 100."""
        return float(self.data["score"])

    @property
    def ride_class(self) -> str:
        """Class of the ride, a grade of this program and no acceptance."""
        return str(self.data["class"])

    @property
    def decided_by(self) -> str:
        """Criterion that decides the class."""
        return str(self.data["decided_by"])

    @property
    def comfort_hours(self) -> float | None:
        """Time to reduced comfort [h]."""
        return shown_value(self.data, "comfort_hours")

    @property
    def weighted_acceleration(self) -> float | None:
        """Lateral acceleration at the comfort point, weighted by W_d, rms [m/s^2]."""
        return shown_value(self.data, "weighted_acceleration")

    @property
    def weighted_acceleration_1974(self) -> float | None:
        """The same with the weighting of the 1970s [m/s^2]."""
        return shown_value(self.data, "weighted_acceleration_1974")

    @property
    def flange_fraction(self) -> float | None:
        """Proportion of flange contact of the worst wheelset."""
        return shown_value(self.data, "flange_fraction")

    @property
    def flange_margin(self) -> float | None:
        """Clearance to the flange, in standard deviations of the displacement."""
        return shown_value(self.data, "flange_margin")

    @property
    def n_mv(self) -> float | None:
        """Mean comfort index N_MV of the lateral direction."""
        return shown_value(self.data, "n_mv")

    @property
    def wz(self) -> float | None:
        """Sperling's ride index Wz."""
        return shown_value(self.data, "wz")

    @property
    def forces(self) -> Mapping[str, Any] | None:
        """Guiding forces and Y/Q with their limits; None if the vehicle diverged or the track is too short."""
        forces: Mapping[str, Any] | None = self.data["forces"]
        return forces

    @property
    def diverged_at(self) -> float | None:
        """Distance s [m] at which the vehicle diverged; None if it did not."""
        diverged = self.data["diverged"]
        return None if diverged is None else float(diverged["at_s"])

    def series(self, channels: Sequence[str] | None = None) -> Series:
        """Return the time series of channels, all by default; ValueError for an unknown one."""
        return simulate_design(self.design, self.excitation.source, self.speed, channels)

    def to_frame(self) -> pandas.DataFrame:
        """Return the time series of all channels as a pandas.DataFrame over t; ImportError without pandas."""
        return self.series().to_frame()

    def to_xarray(self) -> xarray.Dataset:
        """Return the time series of all channels as an xarray.Dataset over t; ImportError without xarray."""
        return self.series().to_xarray()

    def plot_displacement(self, ax: Axes | None = None) -> Axes:
        """Draw the displacements of the wheelsets against time."""
        return self.plot_panel("displacement", ax)

    def plot_acceleration(self, ax: Axes | None = None) -> Axes:
        """Draw the acceleration at the comfort point against time."""
        return self.plot_panel("comfort", ax)

    def plot_spectrum(self, ax: Axes | None = None) -> Axes:
        """Draw the power spectral density of the acceleration at the comfort point."""
        return self.plot_panel("psd_comfort", ax)

    def plot_guiding_forces(self, ax: Axes | None = None) -> Axes:
        """Draw the sums of guiding forces along the line.

        Raises
        ------
        ValueError
            Where the vehicle diverged or the track is too short for them.
        """
        return self.plot_panel("sum_y", ax)

    def plot_panel(self, name: str, ax: Axes | None = None) -> Axes:
        """Draw a panel of the page of `railui ride --plot`.

        Parameters
        ----------
        name : str
            track, displacement, comfort, axle_boxes, psd_e, psd_comfort, sum_y or y_q.
        ax : Axes, optional
            Axes of matplotlib; a new figure by default.

        Raises
        ------
        ValueError
            For a panel that this ride has not.
        """
        panels = self._panels()
        if name not in panels:
            raise ValueError(f"this ride has no panel {name!r}: {suggest_name(name, panels)}")
        return draw_on(ax, panels[name])

    def _panels(self) -> dict[str, Callable[[Axes], None]]:
        panels = ride_panels(self.design, self.excitation.source, self.speed)
        return {name: draw for name, _, draw in panels.panels()}

    def summary_title(self) -> str:
        """Return vehicle, track and speed."""
        return f"{self.design.name} on {self.track} at {self.speed:.4g} m/s ({3.6 * self.speed:.4g} km/h)"

    def summary_rows(self) -> list[SummaryRow]:
        """Return class, deciding criterion and the values of the ride."""
        words = [SummaryRow("class, no acceptance", self.ride_class), SummaryRow("decided by", self.decided_by)]
        numbers = [SummaryRow(key.replace("_", " "), self.data.get(key), unit) for key, unit in UNITS.items()]
        return [*words, *numbers, SummaryRow("diverged at s", self.diverged_at, "m")]


def ride_panels(design: Design, track: TrackLike, speed: float, *, jobs: int | None = 1) -> RidePanels:
    """Simulate all channels of a ride and return the panels of its page, with the series that they draw."""
    from railui.report.ride.figures import RidePanels
    from railui.ride_quality.evaluation import excitation_of
    from railui.ride_quality.time_series import ride_series
    from railui.vehicle.resolve import resolve_model

    model, excitation = resolve_model(design), excitation_of(track, speed)
    return RidePanels(model, excitation, ride_series(model, excitation, jobs=jobs))


def compute_ride(
    design: Design, track: TrackLike, speed: float | str, *, seed: int | None = None, jobs: int | None = None
) -> Ride:
    """Compute the ride quality of a design; parameters and exceptions as `Design.ride`."""
    from railui.ride_quality.evaluation import excitation_of, ride

    excitation = excitation_of(track, speed, seed)
    data = ride(design, excitation.source, excitation.speed, jobs=jobs)
    add_instability_notes(design, [data])
    source = excitation.source
    return Ride(design, data, input_paths(design, source.file), source.seed, excitation=excitation)


def add_instability_notes(design: ModelSource, results: Sequence[dict[str, Any]]) -> None:
    """Add the linear critical speed to the notes of rides that diverged above it."""
    diverged = [result for result in results if result["diverged"] is not None]
    if not diverged:
        return
    from railui.api.modes import linear_critical_speed
    from railui.vehicle.resolve import resolve_model

    model = resolve_model(design)
    critical = linear_critical_speed(model, max(result["speed"] for result in diverged))
    if critical is None:
        return
    has_flange = any(effect.kind == "flange_contact" for effect in model.effects)
    motion = "" if has_flange else ", and the design has no flange_contact: nothing limits its motion"
    at = f"above {critical:.4g} m/s" if critical else "at every speed from 1 m/s"
    for result in diverged:
        if result["speed"] > critical:
            result["notes"] = [*result["notes"], f"linear: unstable {at}{motion}"]
