"""Next runs after a loop that left models undecided."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from railui.progress import SILENT, Progress


def next_runs(
    directory: str | Path,
    speeds: Sequence[float] | None = None,
    track: str | Path | Sequence[str | Path] | None = None,
    *,
    duration: float | None = None,
    sensors: str | Path | None = None,
    noise: Mapping[str, float | str] | None = None,
    sections: int = 1,
    loads: Sequence[str] = (),
    benches: bool = False,
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
    sensors : str or Path, optional
        Sensors that may be added (YAML).
    noise : mapping, optional
        Standard deviations in place of the file's: SI numbers or quantities.
    sections : int
        Places along each track from which a run may start.
    loads : sequence of str
        Load states in which the vehicle may run; by default that of the campaign.
    benches : bool
        Propose benches for the components at which undecided effects act.
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
        For a track that is too short, and an unknown load state.
    """
    from railui.planning.after import load_finished_loop, propose_runs
    from railui.planning.plan_file import load_plan
    from railui.planning.rivals import undecided
    from railui.report.loop.next_run import run_row

    loop = load_finished_loop(directory, seed=seed, jobs=jobs, progress=progress)
    if len(undecided(loop.rivals, loop.context.settings.planning)) < 2:
        return []
    design = loop.context.campaign.design
    levels = {} if sensors is None else load_plan(sensors, design, noise).noise_levels
    tracks = [track] if isinstance(track, str | Path) else track
    found = propose_runs(loop, speeds, tracks, duration, levels, sections, loads, benches)
    return [run_row(run, design.structure) for run in found]
