"""The next run after a finished loop: its rivals, its sensors and noise, and the runs that may be made."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from railui.campaign.campaign import Campaign, load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.noise.model import ColumnNoise, NoiseModel, as_noise_model, white_noise
from railui.campaign.noise.spectrum import NoiseSpectrum
from railui.identification.context import Context, create_context
from railui.io.atomic import sha256_file
from railui.io.problems import file_problem
from railui.planning.component_bench import planned_benches
from railui.planning.next_run import NextRun, next_runs
from railui.planning.planned_runs import PlannedRun, planned_runs
from railui.planning.rivals import RivalModel, read_rivals, undecided
from railui.progress import SILENT, Progress
from railui.runs.columns import is_compared

SPEED_FACTORS: Final = (0.5, 0.65, 0.8, 1.0, 1.15, 1.3)  # of the mean speed of the campaign
MAX_DURATION: Final = 40.0  # s of a proposed run
REPORT = "loop.json"


@dataclass(frozen=True, eq=False)
class FinishedLoop:
    """A finished loop: its campaign and noise, and its rivals, the final model first.

    Attributes
    ----------
    context
        With the noise that the loop used.
    directory
        Of its results.
    """

    context: Context
    rivals: tuple[RivalModel, ...]
    directory: Path

    @property
    def sensors(self) -> tuple[str, ...]:
        """Sensors that count in the error."""
        return compared_sensors(self.context.dataset)


def load_finished_loop(
    directory: str | Path, *, seed: int = 0, jobs: int | None = None, progress: Progress = SILENT
) -> FinishedLoop:
    """Read the report of a loop and its campaign.

    Raises
    ------
    FileProblems
        For a directory without a report, a report of an older version, and a campaign that has changed since.
    """
    report = read_report(directory)
    path = Path(directory) / REPORT
    campaign = _campaign_of(report, path)
    dataset = read_dataset(campaign)
    noise = noise_of_report(report["floor"]["noise"])
    context = create_context(replace(dataset, noise=noise), seed=seed, jobs=jobs, progress=progress)
    try:
        rivals = tuple(read_rivals(report["rivals"], context.nominal))
    except (KeyError, ValueError, IndexError) as error:
        raise file_problem(path, f"its rivals cannot be read: {error}", "run the loop again") from None
    return FinishedLoop(context, rivals, Path(directory))


def read_report(directory: str | Path) -> dict[str, Any]:
    """Return the report of a loop from its directory, with rivals; FileProblems for any other directory."""
    path = Path(directory) / REPORT
    if not path.is_file():
        raise file_problem(directory, f"has no {REPORT}", "name the directory of a loop, such as railui-loop/NAME")
    try:
        report = json.loads(path.read_text("utf-8"))
    except ValueError as error:
        raise file_problem(path, f"is not JSON: {error}", "run the loop again") from None
    if not isinstance(report, dict) or not str(report.get("schema", "")).startswith("railui.loop/"):
        raise file_problem(path, "is not the report of a loop", "name the directory of a loop")
    if report.get("verdict") == "data":
        raise file_problem(path, "stopped at a data fault: it has no model", "correct the data and run the loop again")
    if "rivals" not in report:
        raise file_problem(path, "was written by an older railui: it has no rivals", "run the loop again")
    return report


def _campaign_of(report: Mapping[str, Any], path: Path) -> Campaign:
    """Return the campaign of a report, which must not have changed since."""
    entry = report["inputs"][0]
    source = Path(entry["file"])
    if not source.is_file():
        raise file_problem(path, f"its campaign {source} is not there", "run the command where the loop was run")
    if sha256_file(source) != entry["sha256"]:
        raise file_problem(source, f"has changed since {path} was written", "run the loop again")
    return load_campaign(source)


def noise_of_report(rows: Mapping[str, Mapping[str, Any]]) -> NoiseModel:
    """Return the noise that a loop used from the rows of its report."""

    def column(row: Mapping[str, Any]) -> ColumnNoise:
        coloured = tuple((c["corner_hz"], c["sd"]) for c in row["colour"]["coloured"])
        spectrum = NoiseSpectrum(row["colour"]["white"], coloured)
        return ColumnNoise(row["used"], spectrum, stated=row["stated"], source=row["source"])

    return NoiseModel({name: column(row) for name, row in rows.items()})


def with_noise(context: Context, levels: Mapping[str, float]) -> Context:
    """Return the context with the noise of further sensors."""
    own = as_noise_model(context.dataset.noise).columns
    more = white_noise({name: sd for name, sd in levels.items() if name not in own})
    return replace(context, dataset=replace(context.dataset, noise=NoiseModel({**own, **more.columns})))


def compared_sensors(dataset: Dataset) -> tuple[str, ...]:
    """Return the sensors of all runs that count in the error."""
    names = [set(s.channels) for s in dataset.segments]
    common = set.intersection(*names) if names else set()
    return tuple(c for c in dataset.segments[0].channels if c in common and is_compared(c))


def usual_runs(dataset: Dataset) -> tuple[list[float], Path, float]:
    """Return speeds [m/s] about that of a campaign, the track of its first run, and a duration [s] that fits."""
    segments = dataset.segments
    mean = sum(s.mean_speed for s in segments) / len(segments)
    speeds = sorted({float(max(round(factor * mean), 1)) for factor in SPEED_FACTORS})
    first = dataset.campaign.runs[0].file
    s = max((seg.columns["s"] for seg in segments if seg.run_index == 0), key=len)
    length = float(s[-1] - s[0])
    return speeds, first, min(MAX_DURATION, 0.99 * length / speeds[-1])


def propose_runs(
    loop: FinishedLoop,
    speeds: Sequence[float] | None = None,
    tracks: Sequence[str | Path] | None = None,
    duration: float | None = None,
    levels: Mapping[str, float] | None = None,
    sections: int = 1,
    loads: Sequence[str] = (),
    benches: bool = False,
    most: int | None = None,
) -> list[NextRun]:
    """Assess the runs that may be made next; by default at speeds about that of the campaign on its own track.

    Parameters
    ----------
    levels
        Noise [SI] of sensors that may be added, by their names.
    sections
        Places along each track from which a run may start.
    loads
        Load states in which the vehicle may run; by default that of the campaign.
    benches
        True where the components at which undecided effects act may be put on a bench.
    most
        Number of runs whose chance is computed: those in which the predictions of the rivals differ most; None: all.

    Raises
    ------
    FileProblems, ValueError
        For a faulty track, one that is too short, and speeds at all of which a rival is unstable.
    """
    usual_speeds, first, usual_duration = usual_runs(loop.context.dataset)
    rivals = undecided(loop.rivals, loop.context.settings.planning)
    for state in loads:
        rivals[0].in_load_state(state)  # an unknown one is refused before anything is simulated
    wanted = speeds or usual_speeds, tracks or [first], duration or usual_duration
    runs = _stable_runs(loop.context, rivals, planned_runs(*wanted, sections=sections, loads=loads))
    more = [c for c in levels or {} if c not in loop.sensors and is_compared(c)]
    context = with_noise(loop.context, levels or {})
    tests = planned_benches(context, rivals) if benches else []
    return next_runs(context, rivals, runs, loop.sensors, more, tests, most)


def _stable_runs(context: Context, rivals: Sequence[RivalModel], runs: Sequence[PlannedRun]) -> list[PlannedRun]:
    """Return the runs at whose speed every rival is stable; a message names the others.

    Above its critical speed a rival departs from every other exponentially, which no run of a real vehicle shows.
    """
    limit = context.settings.calibration.max_growth_rate

    def is_stable(run: PlannedRun) -> bool:
        return all(rival.in_load_state(run.load).model.growth_rate(run.speed) <= limit for rival in rivals)

    stable = [run for run in runs if is_stable(run)]
    if left_out := ", ".join(run.name for run in runs if run not in stable):
        context.progress.message(f"left out, since a rival is unstable there: {left_out}")
        if not stable:
            raise ValueError(f"a rival of the loop is unstable at every speed ({left_out}): give lower speeds")
    return stable
