"""Comfort: transfer from the bogie frame to the passenger, comfort filters and comfort indices."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railui.arrays import ComplexArray, FloatArray
from railui.core import adds_body
from railui.dsp.discretise import discretise
from railui.ride_quality.weighting import (
    W_D,
    AnalogFilter,
    brick_wall_1974,
    cascade,
    comfort_cascades,
    isolation_stages,
    transmissibility,
    weighted_rms,
)
from railui.vehicle.design import Design, RidingSettings
from railui.vehicle.model import Model

MINUTE: Final = 60.0  # s
HOUR: Final = 3600.0  # s
DAY: Final = 24 * HOUR
REDUCED_COMFORT_FACTOR: Final = 3.15  # fatigue-decreased proficiency over reduced comfort
MIN_BLOCKS: Final = 60  # blocks of 5 s: five minutes, EN 12299

# ISO 2631 of the 1970s, lateral, 1-2 Hz: time [s] against rms [m/s^2] of fatigue-decreased proficiency
ISO_2631_1974: Final = (
    *((24 * HOUR, 0.100), (16 * HOUR, 0.150), (8 * HOUR, 0.224), (4 * HOUR, 0.355), (2.5 * HOUR, 0.50)),
    *((1 * HOUR, 0.85), (25 * MINUTE, 1.25), (16 * MINUTE, 1.5), (1 * MINUTE, 2.0)),
)

CARBODY_CENTRE: Final = "carbody, its own mass on spring and damper"
IDENTITY_SECTION: Final = np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]])
MIN_DAMPING_RATIO: Final = 1e-6  # of an undamped carbody, for its transfer function to be stable


def floor_points(model: Model) -> tuple[str, ...]:
    """Return the names of the floor points of a vehicle of bodies and elements; empty for a planar bogie."""
    structure = model.design.structure
    return () if structure is None else tuple(part.name for part in structure.floor)


def felt_acceleration(model: Model) -> tuple[str, ...]:
    """Return the acceleration channels from which comfort is computed: the floor points, or the frame."""
    return tuple(f"floor.{name}" for name in floor_points(model)) or ("ayf",)


def carbody_effect(model: Model) -> int | None:
    """Return the index of the effect that adds a carbody above the frame, None if there is none."""
    return next((i for i, e in enumerate(model.design.effects) if adds_body(e.kind)), None)


def fixed_transfer_note(design: Design) -> str | None:
    """Return a note where comfort rests on a fixed transfer from the frame to the floor, None with a carbody."""
    found = fixed_transfer(design)
    return None if found is None else f"comfort: {'; '.join(found)}"


def fixed_transfer(design: Design) -> tuple[str, str] | None:
    """Return the quantity that stands for comfort where its transfer to the floor is fixed, and a remedy.

    A design without a carbody ends at a secondary suspension that is fixed above: its stiffness and damping hold the
    frame, and do not pass its motion on.
    """
    has_floor = design.structure is not None and bool(design.structure.floor)
    if has_floor or any(adds_body(effect.kind) for effect in design.effects):
        return None
    riding = design.riding
    quantity = (
        "acceleration of the frame through a fixed transfer to the floor "
        f"({riding.floor_frequency:g} Hz, damping {riding.floor_damping:g}), "
        "which does not follow the secondary suspension"
    )
    return quantity, "judge secondary springs and dampers with coach_mode or a vehicle with a carbody"


def riding_of_row(model: Model, row: FloatArray) -> RidingSettings:
    """Return the riding settings of one row; a modelled carbody replaces the floor: w0^2 = k/m and 2 z w0 = c/m."""
    riding, number = model.design.riding, carbody_effect(model)
    if number is None:
        return riding
    paths = (f"effects.{number}.{key}" for key in ("mass", "stiffness", "damping"))
    m, k, c = (float(row[model.columns[path]]) for path in paths)
    w0 = float(np.sqrt(k / m))
    damping = max(c / (2 * m * w0), MIN_DAMPING_RATIO)
    return replace(riding, floor_frequency=w0 / (2 * np.pi), floor_damping=damping)


def comfort_sections(model: Model, rows: FloatArray, dt: float) -> dict[str, FloatArray]:
    """Return the streaming filters from the acceleration of frame or floor to each weighted acceleration.

    Parameters
    ----------
    model : Model
        Vehicle.
    rows : FloatArray
        Parameters of n vehicles [n, row].
    dt : float
        Time between samples [s].

    Returns
    -------
    dict of FloatArray
        Sections [n, section, 6] by statistic: those of `comfort_cascades`, and for goods the unweighted `acceleration`.
    """
    has_own_transfer = carbody_effect(model) is not None
    ridings = [riding_of_row(model, row) for row in rows] if has_own_transfer else [model.design.riding]
    indices = {riding: i for i, riding in enumerate(dict.fromkeys(ridings))}
    filters = [_sections(riding, dt, transfer=not floor_points(model)) for riding in indices]
    pick = [indices[riding] for riding in ridings] if len(indices) > 1 else [0] * len(rows)
    return {name: np.stack([each[name] for each in filters])[pick] for name in filters[0]}


def _sections(riding: RidingSettings, dt: float, transfer: bool) -> dict[str, FloatArray]:
    sections = comfort_cascades(riding, dt, transfer)
    if riding.use == "goods":
        point = comfort_point_transfer(riding, transfer)
        sections["acceleration"] = discretise(point, dt) if point.poles.size else IDENTITY_SECTION
    return sections


def comfort_point_transfer(riding: RidingSettings, transfer: bool = True) -> AnalogFilter:
    """Return the transfer function to the comfort point from the frame, or (`transfer` False) from the floor."""
    return cascade(*(transmissibility(*stage) for stage in isolation_stages(riding, transfer)))


def reference_accelerations(model: Model, acceleration: ArrayLike, dt: float) -> dict[str, float]:
    """Return weighted accelerations [m/s^2] computed in the frequency domain, to verify the streaming filters.

    The acceleration [n] of frame or floor is weighted with W_d and with the brick wall of the 1970s at the comfort
    point, by the convention of `weighted_rms`.
    """
    point = comfort_point_transfer(riding_of_row(model, model.row), not floor_points(model))

    def w_1974(f: FloatArray) -> ComplexArray:
        return point.response(f) * brick_wall_1974(f)

    return {
        "weighted_acceleration": weighted_rms(acceleration, dt, cascade(point, W_D)),
        "weighted_acceleration_1974": weighted_rms(acceleration, dt, w_1974),
    }


def comfort_time(rms_1974: ArrayLike) -> FloatArray:
    """Return the time [s] to the reduced-comfort boundary at a weighted acceleration [m/s^2 rms, 1970s weighting].

    Log-log interpolation between the points of ISO 2631 over 3.15, from 1 min to 24 h; clipped outside the table.

    >>> round(float(comfort_time(0.355 / 3.15)) / 3600, 9)
    4.0
    """
    rms = np.asarray(rms_1974, dtype=np.float64)
    seconds, limits = np.array(ISO_2631_1974).T
    with np.errstate(divide="ignore"):
        logarithm = np.interp(np.log(rms), np.log(limits / REDUCED_COMFORT_FACTOR), np.log(seconds))
    return np.asarray(np.clip(np.exp(logarithm), MINUTE, DAY), dtype=np.float64)


def is_comfort_time_clipped(rms_1974: ArrayLike) -> NDArray[np.bool_]:
    """Return True where a weighted acceleration [m/s^2] lies outside the table, beyond 24 h or 1 min.

    >>> bool(is_comfort_time_clipped(0.01)), bool(is_comfort_time_clipped(0.1))
    (True, False)
    """
    rms = np.asarray(rms_1974, dtype=np.float64)
    lowest, highest = ISO_2631_1974[0][1], ISO_2631_1974[-1][1]
    return (rms < lowest / REDUCED_COMFORT_FACTOR) | (rms > highest / REDUCED_COMFORT_FACTOR)


def comfort_index(time: ArrayLike) -> FloatArray:
    """Return the comfort index of a comfort time [s]: 0 at 1 min, 1 at 24 h, linear in its logarithm.

    >>> round(float(comfort_index(4 * 3600.0)), 4)  # ln 240/ln 1440
    0.7536
    """
    index = np.log(np.asarray(time, dtype=np.float64) / MINUTE) / np.log(DAY / MINUTE)
    return _clipped(index)


def goods_index(rms: ArrayLike, peak: ArrayLike | None, rms_limit: float, peak_limit: float | None) -> FloatArray:
    """Return the index that replaces comfort for goods: the lesser of 1 - rms/limit and 1 - peak/limit, 0 to 1.

    Accelerations [m/s^2] at the load. Raises ValueError for a peak limit without a peak.

    >>> float(goods_index(0.5, 3.0, 2.0, 4.0))
    0.25
    """
    index = 1 - np.asarray(rms, dtype=np.float64) / rms_limit
    if peak_limit is not None:
        if peak is None:
            raise ValueError(f"riding.peak_limit is {peak_limit:g} m/s^2, but the statistics contain no peak")
        index = np.minimum(index, 1 - np.asarray(peak, dtype=np.float64) / peak_limit)
    return _clipped(index)


def _clipped(index: FloatArray) -> FloatArray:
    return np.asarray(np.clip(index, 0.0, 1.0), dtype=np.float64)


def sperling_wz(rms_sperling: ArrayLike) -> FloatArray:
    """Return Sperling's Wz = 4.42 (rms [m/s^2] of the acceleration weighted with B)^0.3.

    >>> round(float(sperling_wz(0.2)), 4)
    2.7273
    """
    return np.asarray(4.42 * np.asarray(rms_sperling, dtype=np.float64) ** 0.3, dtype=np.float64)


def n_mv(block_rms: ArrayLike) -> float | None:
    """Return the lateral part of the mean comfort N_MV: 6 times the 95th percentile of block rms [m/s^2].

    Blocks are of 5 s, weighted with W_d; None for fewer than 60. EN 12299 adds the vertical and longitudinal axes,
    which a lateral model lacks.

    >>> n_mv([0.1] * 59) is None, round(n_mv([0.1] * 60), 9)
    (True, 0.6)
    """
    blocks = np.asarray(block_rms, dtype=np.float64)
    if blocks.size < MIN_BLOCKS or not np.all(np.isfinite(blocks)):
        return None
    return 6.0 * float(np.percentile(blocks, 95))
