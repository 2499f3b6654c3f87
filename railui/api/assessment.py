"""Evaluation of simulated or measured rides by the rules of EN 14363."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from railui.io.units import read_speed
from railui.ride_quality.en14363.evaluation import EXCEEDED as EXCEEDED
from railui.ride_quality.en14363.evaluation import evaluate_measured, evaluate_simulated

if TYPE_CHECKING:
    from railui.ride_quality.evaluation import TrackLike
    from railui.vehicle.resolve import ModelSource


def assess_en14363(
    track: TrackLike,
    design: ModelSource,
    speed: float | str | None = None,
    *,
    measured: bool = False,
    cant_deficiency: float | None = None,
    seed: int | None = None,
    jobs: int | None = None,
) -> dict[str, Any]:
    """Evaluate forces and accelerations by the rules of EN 14363, as `railui assess --method en14363`.

    Parameters
    ----------
    track : Track, TrackSource, spec or path
        Track; with `measured` the path of a run.
    design : Design, Model or path
    speed : float or str, optional
        Speed [m/s], or a quantity; a measured run has its own.
    measured : bool
        Evaluate the measured columns of a run.
    cant_deficiency : float, optional
        Target [m] of the two-dimensional method; one-dimensional without it.
    seed : int, optional
        Seed that replaces that of the spec.
    jobs : int, optional
        Threads; by default all.

    Returns
    -------
    dict
        verdict, zones with their quantities and limits, exceeded, missing, notes. It is not an acceptance.

    Raises
    ------
    FileProblems
        For faulty files.
    ValueError
        Without a speed of a simulation, with one of a measured run, and for a faulty spec.
    """
    if measured:
        if speed is not None or seed is not None:
            raise ValueError("a measured run has its own speed and no seed: leave speed and seed out")
        if not isinstance(track, str | Path):
            raise ValueError("measured columns are those of a run: give its path")
        return evaluate_measured(track, design, cant_deficiency=cant_deficiency)
    if speed is None:
        raise ValueError("give the speed of the simulation")
    v = read_speed(speed) if isinstance(speed, str) else float(speed)
    return evaluate_simulated(track, design, v, cant_deficiency=cant_deficiency, seed=seed, jobs=jobs)
