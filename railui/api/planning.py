"""Plans of measurements: sensors and runs before any measurement, and the next run after a loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from railui.api.design import as_design
from railui.progress import SILENT, Progress

if TYPE_CHECKING:
    from railui.vehicle.design import Design

DURATION: Final = 60.0  # s of a run


def plan(
    design: Design | str | Path,
    sensors: str | Path,
    speeds: Sequence[float | str],
    track: str | Path | Sequence[str | Path],
    *,
    duration: float = DURATION,
    sections: int = 1,
    noise: Mapping[str, float | str] | None = None,
    budget: float | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> dict[str, Any]:
    """Plan a measurement campaign: sensors and runs that would detect effects of a design, as `railui plan`.

    Parameters
    ----------
    design : Design, str or Path
        Nominal vehicle.
    sensors : str or Path
        Sensors that may be mounted, their noise and costs (YAML).
    speeds : sequence of float or str
        Speeds [m/s] that may be run, or quantities.
    track : str, Path or sequence
        Specs or files; every speed is run on every track.
    duration : float
        Duration [s] of a run.
    sections : int
        Sections of each track on which runs are planned.
    noise : mapping, optional
        Standard deviations in place of the file's: SI numbers or quantities.
    budget : float, optional
        Largest cost, in place of the file's.
    seed : int, optional
        Seed of synthetic tracks and of the noise.
    jobs : int, optional
        Threads; by default all.
    progress : Progress
        Receiver of messages.

    Returns
    -------
    dict
        The keys of railui.plan/1, documented in docs/results.md.

    Raises
    ------
    FileProblems
        For faulty files.
    ValueError
        For fewer than two runs at which the vehicle is stable.
    """
    from railui.io.units import read_speed
    from railui.planning.plan import make_plan, plan_document
    from railui.planning.plan_file import load_plan

    file = load_plan(sensors, as_design(design), noise)
    if budget is not None:
        file = replace(file, budget=budget)
    tracks = [track] if isinstance(track, str | Path) else list(track)
    grid = [read_speed(v) if isinstance(v, str) else float(v) for v in speeds]
    return plan_document(
        make_plan(file, grid, tracks, duration, seed=seed, jobs=jobs, progress=progress, sections=sections)
    )


def next_runs(
    directory: str | Path,
    speeds: Sequence[float] | None = None,
    track: str | Path | Sequence[str | Path] | None = None,
    *,
    duration: float | None = None,
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> list[dict[str, Any]]:
    """Rank runs by the probability that they separate the models that a loop left undecided, as `railui plan --after`.

    Parameters
    ----------
    directory : str or Path
        Results of a loop.
    speeds : sequence of float, optional
        Speeds [m/s]; by default about that of the campaign.
    track : str, Path or sequence, optional
        Specs or files; that of the campaign by default.
    duration : float, optional
        Duration [s] of a run; that of the campaign by default.
    seed, jobs, progress
        As for `plan`.

    Returns
    -------
    list of dict
        Runs as in `next_runs` of the loop report, the best first; empty where the data separate the final model.

    Raises
    ------
    FileProblems
        For a directory without the report of a loop.
    ValueError
        For a track that is too short.
    """
    from railui.planning.after import load_finished_loop, propose_runs
    from railui.planning.rivals import undecided
    from railui.report.loop.next_run import run_row

    loop = load_finished_loop(directory, seed=seed, jobs=jobs, progress=progress)
    if len(undecided(loop.rivals, loop.context.settings.planning)) < 2:
        return []
    tracks = [track] if isinstance(track, str | Path) else track
    return [run_row(run) for run in propose_runs(loop, speeds, tracks, duration)]
