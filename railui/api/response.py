"""Response of the linear vehicle: transfer functions, spectral densities, rms, state space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from railui.api.design import Design, as_design
from railui.api.display import SummaryRow, draw_on
from railui.api.result import DesignResult, input_paths
from railui.arrays import ComplexArray, FloatArray
from railui.io.units import read_speed
from railui.vehicle.design import Design as VehicleDesign

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

    from railui.ride_quality.evaluation import TrackLike
    from railui.vehicle.model import Model
    from railui.vehicle.state_space import StateSpace
    from railui.vehicle.transfer import LinearVehicle


@dataclass(frozen=True, eq=False)
class Response(DesignResult):
    """Transfer functions of the linear vehicle and its stationary response; `Design.response` computes them.

    Attributes
    ----------
    design : Design
    data : mapping
        The result of `railui.response`.

    Examples
    --------
    >>> response = Design.load("designs/check_bogie.yaml").response(40.0, "erri_b176_low", channels=["e1"])
    >>> response.is_stable, round(1e3 * response.rms["e1"], 3), response.transfer("e1").shape
    (True, 1.47, (303,))
    """

    COMMAND: ClassVar[str] = "response"

    @property
    def speed(self) -> float:
        """Speed [m/s]."""
        return float(self.data["speed"])

    @property
    def frequencies(self) -> FloatArray:
        """Frequencies [frequency] in Hz."""
        return np.asarray(self.data["frequencies"], dtype=float)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(self.data["channels"])

    @property
    def units(self) -> dict[str, str]:
        """Unit of each channel."""
        return {name: str(channel["unit"]) for name, channel in self.data["channels"].items()}

    @property
    def is_stable(self) -> bool:
        """True if every motion decays."""
        return bool(self.data["stable"])

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square of each channel; empty without a track and for an unstable vehicle."""
        return {name: float(one["rms"]) for name, one in (self.data["stationary"] or {}).items()}

    def transfer(self, channel: str, irregularity: str = "yw") -> ComplexArray:
        """Return the transfer function [frequency] from an irregularity under the leading wheelset to a channel."""
        one = self.data["transfer"][channel][irregularity]
        return np.asarray(np.asarray(one["magnitude"]) * np.exp(1j * np.asarray(one["phase"])))

    def density(self, channel: str) -> FloatArray:
        """Return the one-sided power spectral density [frequency] of a channel, per Hz.

        Raises
        ------
        ValueError
            Without a track, and for an unstable vehicle.
        """
        if self.data["stationary"] is None:
            raise ValueError("there is no stationary response: give a track, and a speed below the critical speed")
        return np.asarray(self.data["stationary"][channel]["psd"], dtype=float)

    def to_frame(self) -> pandas.DataFrame:
        """Return magnitudes and phases [rad] by `channel/irregularity`, over frequency; ImportError without pandas."""
        from railui.api.frames import data_frame

        columns, units = self._columns()
        return data_frame(columns, "frequency", units)

    def to_xarray(self) -> xarray.Dataset:
        """Return the columns of `to_frame` as an xarray.Dataset over frequency; ImportError without xarray."""
        from railui.api.frames import data_set

        columns, units = self._columns()
        return data_set(columns, "frequency", units, {"title": self.summary_title()})

    def _columns(self) -> tuple[dict[str, FloatArray], dict[str, str]]:
        columns: dict[str, FloatArray] = {"frequency": self.frequencies}
        units = {"frequency": "Hz"}
        for channel, inputs in self.data["transfer"].items():
            for irregularity, one in inputs.items():
                name = f"{channel}/{irregularity}"
                columns |= {name: np.asarray(one["magnitude"]), f"{name} phase": np.asarray(one["phase"])}
                units |= {name: one["unit"], f"{name} phase": "rad"}
        return columns, units

    def plot_magnitude(self, channel: str, irregularity: str = "yw", ax: Axes | None = None) -> Axes:
        """Draw the magnitude of a transfer function against frequency."""
        from railui.report.figures.response import draw_channels

        def draw(on: Axes) -> None:
            draw_channels(on, self.data, [channel], irregularity)
            on.set_xlabel("frequency [Hz]")

        return draw_on(ax, draw)

    def plot_density(self, channel: str, ax: Axes | None = None) -> Axes:
        """Draw the power spectral density of a channel; ValueError as `density`."""
        from railui.report.figures.response import draw_channels

        self.density(channel)

        def draw(on: Axes) -> None:
            draw_channels(on, self.data, [channel], "psd")
            on.set_xlabel("frequency [Hz]")

        return draw_on(ax, draw)

    def summary_title(self) -> str:
        """Return the vehicle and its speed."""
        return f"linear response of {self.design.name} at {self.speed:.4g} m/s"

    def summary_rows(self) -> list[SummaryRow]:
        """Return the root that decays most slowly and the rms of each channel."""
        rows = [SummaryRow("slowest root", slowest_root(self.data))]
        return [*rows, *(SummaryRow(f"rms {name}", rms, self.units[name]) for name, rms in self.rms.items())]


def slowest_root(data: Mapping[str, Any]) -> str:
    """Return the root of a response that decays most slowly, constants left out, in words."""
    from railui.vehicle.linear import MIN_ROOT

    root = next(z for z in data["roots"] if abs(complex(z["real"], z["imag"])) >= MIN_ROOT)
    return f"{root['real']:.4f} + {root['imag']:.4f}j 1/s"


def compute_response(
    design: Design,
    speed: float | str,
    track: TrackLike | None = None,
    *,
    channels: Sequence[str] | None = None,
    frequencies: Sequence[float] | None = None,
    seed: int | None = None,
) -> Response:
    """Compute the response of a design; parameters and exceptions as `Design.response`."""
    from railui.ride_quality.linear_response import response
    from railui.track.excitation import resolve_track

    source = None if track is None else resolve_track(track, seed)
    grid = None if frequencies is None else np.asarray(frequencies, dtype=float)
    data = response(design, _metres_per_second(speed), source, channels, grid)
    file, used_seed = (None, None) if source is None else (source.file, source.seed)
    return Response(design, data, input_paths(design, file), used_seed)


def linear_vehicle(design: VehicleDesign, speed: float | str, channels: Sequence[str] | None = None) -> LinearVehicle:
    """Return the linear equations of a design; parameters and exceptions as `Design.linearise`."""
    from railui.vehicle.transfer import linearise

    return linearise(*checked_vehicle(design, speed, channels))


def state_space_of(design: VehicleDesign, speed: float | str, channels: Sequence[str] | None = None) -> StateSpace:
    """Return the state space of a design; parameters and exceptions as `Design.state_space`."""
    from railui.vehicle.state_space import state_space

    return state_space(*checked_vehicle(design, speed, channels))


def export_state_space(
    design: VehicleDesign | str | Path, file: str | Path, speed: float | str, channels: Sequence[str] | None = None
) -> StateSpace:
    """Write the linear vehicle at a speed as state space, as `railui export --state-space`.

    Parameters
    ----------
    design : Design, str or Path
    file : str or Path
        Name that ends in .npz (NumPy) or .mat (MATLAB).
    speed : float or str
        Speed [m/s], or a quantity.
    channels : sequence of str, optional
        Outputs; those of a run by default.

    Returns
    -------
    StateSpace
        The matrices with names and units of states, inputs and outputs.

    Raises
    ------
    FileProblems
        For a faulty design, and a test rig.
    ValueError
        For another suffix, an unknown channel or a speed that is not positive.
    """
    from railui.documents.state_space_file import check_state_space_file, write_state_space

    check_state_space_file(file)
    space = state_space_of(as_design(design), speed, channels)
    write_state_space(file, space)
    return space


def checked_vehicle(
    design: VehicleDesign, speed: float | str, channels: Sequence[str] | None
) -> tuple[Model, float, list[str]]:
    """Return model, speed [m/s] and channels of a vehicle, checked; those of a run by default."""
    from railui.ride_quality.linear_response import default_channels
    from railui.vehicle.channels import check_channels
    from railui.vehicle.resolve import resolve_model

    model, v = resolve_model(design), _metres_per_second(speed)
    if not 0 < v < np.inf:
        raise ValueError(f"speed must be positive: {v:g} m/s")
    names = default_channels(model) if channels is None else list(channels)
    check_channels(model, names)
    return model, v, names


def _metres_per_second(speed: float | str) -> float:
    return read_speed(speed) if isinstance(speed, str) else float(speed)
