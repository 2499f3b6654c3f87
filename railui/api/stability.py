"""Stability of a design: modes, linear and nonlinear critical speed, speed limit by ride criteria."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final

from railui.api.design import Design
from railui.api.display import SummaryRow, draw_on, shown_value
from railui.api.result import DesignResult, input_paths
from railui.progress import SILENT, Progress

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from railui.ride_quality.evaluation import TrackLike

MODE_UNITS: Final = {
    "speed": "m/s",
    "real": "1/s",
    "imag": "rad/s",
    "frequency": "Hz",
    "damping": "1",
    "decrement": "1",
}


@dataclass(frozen=True, eq=False)
class Stability(DesignResult):
    """Modes of a design over speed and its critical speeds; `Design.stability` computes them.

    Attributes
    ----------
    design : Design
    data : mapping
        The result of `railui.stability`.

    Examples
    --------
    >>> stability = Design.load("designs/check_bogie.yaml").stability([20.0, 40.0, 80.0])
    >>> stability.speeds, round(stability.linear_critical_frequency, 2)
    ((20.0, 40.0, 80.0), 4.87)
    """

    COMMAND: ClassVar[str] = "stability"
    units: ClassVar[Mapping[str, str]] = MODE_UNITS

    @property
    def speeds(self) -> tuple[float, ...]:
        """Speeds [m/s]."""
        return tuple(self.data["speeds"])

    @property
    def linear_critical_speed(self) -> float | None:
        """Speed at which a mode of the linear vehicle becomes unstable [m/s]; None beyond the range."""
        return shown_value(self.data, "linear_critical_speed")

    @property
    def linear_critical_speed_sd(self) -> float | None:
        """Its standard deviation from those of estimated parameters [m/s]; None without any."""
        return shown_value(self.data, "linear_critical_speed_sd")

    @property
    def linear_critical_frequency(self) -> float | None:
        """Frequency of that mode [Hz]."""
        return shown_value(self.data, "linear_critical_frequency")

    @property
    def linear_damping(self) -> float:
        """Least damping ratio over the speeds."""
        return float(self.data["linear_damping"])

    @property
    def nonlinear_critical_speed(self) -> float | None:
        """Saddle-node of limit cycles [m/s]; None where not requested or beyond the range."""
        return shown_value(self.data, "fold_speed")

    @property
    def practical_critical_speed(self) -> float | None:
        """Speed limit by ride criteria [m/s]; None where not requested or admissible at all speeds."""
        return shown_value(self.data, "practical_critical_speed")

    @property
    def klingel_wavelength(self) -> float | None:
        """Wavelength of the kinematic motion of a free wheelset [m]."""
        return shown_value(self.data, "klingel_wavelength")

    @property
    def modes(self) -> tuple[Mapping[str, Any], ...]:
        """Modes at every speed: speed, real, imag, frequency, damping, decrement, shape."""
        return tuple(self.data["modes"])

    @property
    def least_damped_oscillations(self) -> tuple[Mapping[str, Any], ...]:
        """The oscillation with the smallest damping ratio at every speed that has one, as in `modes`."""
        from railui.running_stability.modes import least_damped_mode

        oscillations = [mode for mode in self.modes if mode["imag"] > 0]
        found = (least_damped_mode(m for m in oscillations if m["speed"] == v) for v in self.speeds)
        return tuple(mode for mode in found if mode is not None)

    def to_frame(self) -> pandas.DataFrame:
        """Return the modes as a pandas.DataFrame, one row for each speed and mode; ImportError without pandas."""
        from railui.api.frames import frame_of_rows

        return frame_of_rows(self.modes, MODE_UNITS)

    def plot_damping(self, ax: Axes | None = None) -> Axes:
        """Draw the damping ratios of the oscillations below 30 Hz against speed."""
        from railui.report.figures.stability import draw_critical_speeds, draw_damping

        return self._draw(ax, draw_damping, draw_critical_speeds)

    def plot_frequency(self, ax: Axes | None = None) -> Axes:
        """Draw the frequencies of the oscillations below 30 Hz against speed, and Klingel's."""
        from railui.report.figures.stability import draw_critical_speeds, draw_frequencies

        return self._draw(ax, draw_frequencies, draw_critical_speeds)

    def plot_bifurcation(self, ax: Axes | None = None) -> Axes:
        """Draw the amplitudes of limit cycles against speed.

        Raises
        ------
        ValueError
            Without the nonlinear critical speed: compute with `fold=True`.
        """
        from railui.report.figures.stability import draw_bifurcation

        if not self.data["fold"] or not self.data["fold"]["diagram"]:
            raise ValueError("there are no limit cycles to draw: compute the stability with fold=True")
        return self._draw(ax, draw_bifurcation)

    def _draw(self, ax: Axes | None, *draws: Any) -> Axes:
        def draw(on: Axes) -> None:
            for each in draws:
                each(on, self.data)
            on.set_xlabel("speed [m/s]")

        return draw_on(ax, draw)

    def summary_title(self) -> str:
        """Return the vehicle and the range of speeds."""
        return f"stability of {self.design.name}, {self.speeds[0]:.4g} to {self.speeds[-1]:.4g} m/s"

    def summary_rows(self) -> list[SummaryRow]:
        """Return the critical speeds."""
        rows = [
            SummaryRow("linear critical speed", self.linear_critical_speed, "m/s"),
            SummaryRow("its frequency", self.linear_critical_frequency, "Hz"),
            SummaryRow("least damping ratio", self.linear_damping, "1"),
            SummaryRow("Klingel wavelength", self.klingel_wavelength, "m"),
        ]
        if self.data["fold"]:
            rows.append(SummaryRow("nonlinear critical speed", self.nonlinear_critical_speed, "m/s"))
        if self.data["practical"]:
            rows.append(SummaryRow("speed limit by ride criteria", self.practical_critical_speed, "m/s"))
        return rows


def compute_stability(
    design: Design,
    speeds: Sequence[float] | None = None,
    *,
    fold: bool = False,
    track: TrackLike | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> Stability:
    """Compute the stability of a design; parameters and exceptions as `railui.stability`."""
    from railui.running_stability.summary import DEFAULT_SPEEDS, stability
    from railui.track.excitation import resolve_track

    source = None if track is None else resolve_track(track, seed)
    grid = DEFAULT_SPEEDS if speeds is None else speeds
    data = stability(design, grid, fold=fold, track=source, jobs=jobs, progress=progress)
    file, used_seed = (None, None) if source is None else (source.file, source.seed)
    return Stability(design, data, input_paths(design, file), used_seed)
