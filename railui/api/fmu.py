"""Vehicle as a functional mock-up unit, and the samples of a track as its inputs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.api.design import as_design
from railui.vehicle.design import Design as VehicleDesign

if TYPE_CHECKING:
    from railui.ride_quality.evaluation import TrackLike
    from railui.vehicle.fmu_vehicle import FmuVehicle

DEFAULT_SPEED: Final = 40.0  # m/s, start value of the parameter


def fmu_vehicle_of(
    design: VehicleDesign, speed: float | str = DEFAULT_SPEED, channels: Sequence[str] | None = None
) -> FmuVehicle:
    """Return the vehicle of an FMU; parameters and exceptions as `export_fmu`."""
    from railui.api.response import checked_vehicle
    from railui.vehicle.fmu_vehicle import fmu_vehicle

    return fmu_vehicle(*checked_vehicle(design, speed, channels))


def export_fmu(
    design: VehicleDesign | str | Path,
    file: str | Path,
    speed: float | str = DEFAULT_SPEED,
    channels: Sequence[str] | None = None,
) -> FmuVehicle:
    """Write a vehicle with its effects as an FMU (FMI 3.0, co-simulation), as `railui export --fmu`.

    Parameters
    ----------
    design : Design, str or Path
        Such as the calibrated one.
    file : str or Path
        Name that ends in .fmu.
    speed : float or str
        Start value of the parameter `speed` [m/s], or a quantity.
    channels : sequence of str, optional
        Outputs; those of a run by default.

    Returns
    -------
    FmuVehicle
        Inputs, parameters and outputs with units and start values.

    Raises
    ------
    FileProblems
        For a faulty design, and a test rig.
    ValueError
        For another suffix, an unknown channel, a speed that is not positive, and where the kernel is no library of
        Linux.
    """
    from railui.documents.fmu_file import check_fmu_file, write_fmu

    check_fmu_file(file)
    vehicle = fmu_vehicle_of(as_design(design), speed, channels)
    write_fmu(file, vehicle)
    return vehicle


def fmu_inputs(track: TrackLike, speed: float | str, *, seed: int | None = None) -> NDArray[Any]:
    """Return a track at a speed as the inputs of an FMU, one row per sample of the track.

    Parameters
    ----------
    track, speed, seed
        As for `ride`.

    Returns
    -------
    structured array [sample]
        time [s], then the inputs; the slopes are those of the spline through the track.

    Raises
    ------
    ValueError
        For a track with curves, and as `ride`.

    Examples
    --------
    >>> inputs = fmu_inputs("erri_b176_low length=100", 40.0)
    >>> inputs.dtype.names[:3], len(inputs), float(inputs["time"][1])
    (('time', 'yw', 'dyw_ds'), 1000, 0.0025)
    """
    from railui.core import Spline
    from railui.ride_quality.evaluation import excitation_of
    from railui.vehicle.fmu_vehicle import TRACK_INPUTS

    excitation = excitation_of(track, speed, seed)
    line = excitation.track
    if line.has_curves:
        raise ValueError(f"{excitation.source.name} has curves: the vehicle of an FMU runs on straight track")
    values = np.stack([line.yw, line.phiw, line.gauge], axis=1)
    spline = Spline(line.s, values)
    slopes = spline(line.s, 1)
    inputs = np.zeros(len(line.s), dtype=[(name, float) for name in ("time", *(name for name, _, _ in TRACK_INPUTS))])
    inputs["time"] = (line.s - line.s[0]) / excitation.speed
    for i, name in enumerate(("yw", "phiw", "gauge")):
        inputs[name], inputs[f"d{name}_ds"] = values[:, i], slopes[:, i]
    return inputs
