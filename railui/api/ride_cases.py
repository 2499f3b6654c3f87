"""Rides over several speeds and seeds, with their mean, standard deviation and worst case."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from railui.progress import SILENT, Progress

if TYPE_CHECKING:
    from railui.ride_quality.evaluation import TrackLike
    from railui.vehicle.resolve import ModelSource

NOT_AVERAGED: Final = ("steps", "speed", "seed", "comfort_clipped")
LISTS: Final = ("flange_fractions",)


def ride_cases(
    design: ModelSource,
    track: TrackLike,
    speeds: Sequence[float | str],
    *,
    seeds: Sequence[int] | None = None,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> dict[str, Any]:
    """Compute the ride quality over speeds and seeds, as `railui ride --speeds --seeds`.

    Parameters
    ----------
    design : Design, Model or path
    track : Track, TrackSource, spec or path
    speeds : sequence of float or str
        Speeds [m/s], or quantities.
    seeds : sequence of int, optional
        Seeds of the track; that of the spec by default.
    jobs : int, optional
        Threads; by default all.
    progress : Progress
        Receives a message after every simulation.

    Returns
    -------
    dict
        `cases`: results of `railui.ride_many`; `mean` and `sd` (n - 1) of every number, None where a case has no value;
        `worst`: speed, seed, class and reason of the worst case and the largest measures of safety; `notes`.

    Raises
    ------
    FileProblems, ValueError
        As `railui.ride`; ValueError without a speed.

    Examples
    --------
    >>> result = ride_cases("designs/test_bogie.yaml", "erri_b176_low length=500", [30.0, 40.0], seeds=[1, 2])
    >>> len(result["cases"]), result["worst"]["speed"]
    (4, 40.0)
    """
    from railui.api.ride import add_instability_notes
    from railui.ride_quality.evaluation import excitation_of, simulate_rides
    from railui.track.excitation import resolve_track
    from railui.vehicle.resolve import resolve_model

    if not speeds:
        raise ValueError("give at least one speed")
    model, asked = resolve_model(design), [None] if seeds is None else list(seeds)
    cases: list[dict[str, Any]] = []
    for source in [resolve_track(track, seed) for seed in asked]:
        for speed in speeds:
            cases += simulate_rides([model], excitation_of(source, speed), jobs)
            progress.message(f"{len(cases)} of {len(asked) * len(speeds)} simulations")
    add_instability_notes(model, cases)
    return summarise_cases(cases)


def summarise_cases(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Return cases with mean and standard deviation (n - 1) of every number; None where a case has no value."""
    import numpy as np

    numeric = [
        key
        for key in cases[0]
        if key not in NOT_AVERAGED and any(_is_numeric(case[key], key in LISTS) for case in cases)
    ]
    mean: dict[str, Any] = {}
    sd: dict[str, Any] = {}
    for key in numeric:
        values = [case[key] for case in cases]
        is_complete = all(value is not None for value in values)
        mean[key] = np.mean(values, axis=0) if is_complete else None
        sd[key] = np.std(values, axis=0, ddof=1) if is_complete and len(values) > 1 else None
    diverged = sum(case["diverged"] is not None for case in cases)
    incomplete = ", ".join(key for key, value in mean.items() if value is None)
    notes = []
    if diverged:
        notes = [f"mean and sd: null where a case has no value, {diverged} of {len(cases)} diverged"]
    elif incomplete:
        notes = [f"mean and sd: null for {incomplete}, of which a case has no value (see its notes)"]
    return {
        "cases": cases,
        "mean": mean,
        "sd": sd,
        "worst": worst_case(cases),
        "notes": [*notes, "sd: of the sample, n - 1"],
    }


def worst_case(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Return speed, seed, class and reason of the worst case, and the largest value of each measure of safety."""
    from railui.ride_quality.running_safety import SAFETY_KEYS
    from railui.ride_quality.score import CLASSES

    worst = min(cases, key=lambda case: (CLASSES.index(case["class"]), case["score"]))
    largest = {key: max((case[key] for case in cases if case[key] is not None), default=None) for key in SAFETY_KEYS}
    return {key: worst[key] for key in ("speed", "seed", "class", "decided_by")} | largest


def _is_numeric(value: Any, is_list: bool) -> bool:
    return isinstance(value, list) if is_list else isinstance(value, int | float) and not isinstance(value, bool)
