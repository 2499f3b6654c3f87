"""Plan of a measurement campaign before any measurement: sensors and runs that would detect effects of a design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

from railui.api.design import Design, as_design
from railui.api.display import SummaryRow, draw_on
from railui.api.result import DesignResult, input_paths
from railui.progress import SILENT, Progress
from railui.vehicle.design import Design as VehicleDesign

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from railui.io.problems import Problem
    from railui.parallel import Pool
    from railui.planning.plan import CandidateRuns
    from railui.planning.plan_file import PlanFile

DURATION: Final = 60.0  # s of a run
SELECTION_SIZE: Final = (6.4, 2.6)  # inch

Tracks = str | Path | Sequence[str | Path]


@dataclass(frozen=True, eq=False)
class Plan(DesignResult):
    """Planned campaign of a design; `Design.plan` computes it.

    Attributes
    ----------
    design : Design
        Nominal vehicle.
    data : mapping
        The result of `railui.plan`.
    warnings : tuple of Problem
        Warnings about the file of the sensors.
    """

    COMMAND: ClassVar[str] = "plan"

    warnings: tuple[Problem, ...] = field(default=(), kw_only=True)

    @property
    def runs(self) -> tuple[Mapping[str, Any], ...]:
        """Runs that may be made: name, speed, track, start, length, cost."""
        return tuple(self.data["runs"])

    @property
    def sensors(self) -> tuple[Mapping[str, Any], ...]:
        """Sensors that may be mounted: name, noise, unit, cost."""
        return tuple(self.data["sensors"])

    @property
    def selected(self) -> Mapping[str, Any] | None:
        """Selected sensors, estimation runs and validation run; None where the budget allows for none."""
        selected: Mapping[str, Any] | None = self.data["selected"]
        return selected

    @property
    def steps(self) -> tuple[Mapping[str, Any], ...]:
        """Steps of the selection: added, cost, attained_share."""
        return tuple(self.data["steps"])

    @property
    def detectable(self) -> tuple[Mapping[str, Any], ...]:
        """Minimum detectable effects: of the selection, with everything, and of every run alone."""
        return tuple(self.data["detectable"])

    @property
    def parameters(self) -> tuple[Mapping[str, Any], ...]:
        """Parameters: path, value, unit, and their standard deviations."""
        return tuple(self.data["parameters"])

    @property
    def sentence(self) -> str:
        """Selection in one sentence."""
        from railui.report.plan.rows import sentence

        return sentence(self.data)

    def to_frame(self) -> pandas.DataFrame:
        """Return the minimum detectable effects, a column for every run; ImportError without pandas."""
        from railui.api.frames import frame_of_rows

        names = [run["name"] for run in self.runs]
        lists = ("per_run", "per_step")
        rows = [
            {key: value for key, value in one.items() if key not in lists}
            | dict(zip(names, one["per_run"], strict=True))
            for one in self.detectable
        ]
        return frame_of_rows(rows)

    def plot_limits(self, ax: Axes | None = None) -> Axes:
        """Draw the minimum detectable effects of the selection, of everything and of every run."""
        from railui.report.plan.figures import draw_limits, map_size
        from railui.report.plan.rows import effect_rows

        rows = effect_rows(self.data, structure=self.design.structure)
        return draw_on(ax, lambda on: draw_limits(on, self.data, rows), map_size(self.data, rows))

    def plot_selection(self, ax: Axes | None = None) -> Axes:
        """Draw the attained precision against the cost of the selection.

        Raises
        ------
        ValueError
            Where the budget allows for no selection.
        """
        from railui.report.plan.figures import draw_selection

        if not self.steps:
            raise ValueError("the budget allows for no selection: raise it")
        return draw_on(ax, lambda on: draw_selection(on, self.data), SELECTION_SIZE)

    def save(self, path: str | Path) -> Path:
        """Write the page (.html) or the map of limits (.svg, .png, .pdf), as `railui plan --plot`."""
        from railui.report.plan.figures import draw_plan
        from railui.report.plan.page import write_plan_page
        from railui.report.plan.rows import effect_rows

        document, structure = self.to_dict(), self.design.structure
        if str(path).lower().endswith(".html"):
            return write_plan_page(document, structure, path)
        draw_plan(document, effect_rows(document, structure=structure), path)
        return Path(path)

    def summary_title(self) -> str:
        """Return the vehicle and the number of runs."""
        return f"plan of a campaign for {self.design.name}, {len(self.runs)} runs and {len(self.sensors)} sensors"

    def summary_rows(self) -> list[SummaryRow]:
        """Return the steps of the selection."""
        return [
            SummaryRow(f"+ {one['added']}", f"cost {one['cost']:g}, precision {100 * one['attained_share']:.0f} %")
            for one in self.steps
        ]

    def summary_notes(self) -> Sequence[str]:
        """Return the selection in words, the notes and the warnings."""
        return [self.sentence, *self.notes, *map(str, self.warnings)]


def read_plan_file(
    design: Design,
    sensors: str | Path,
    noise: Mapping[str, float | str] | None = None,
    budget: float | None = None,
) -> PlanFile:
    """Return the sensors of a plan; FileProblems for a faulty file."""
    from railui.planning.plan_file import load_plan

    file = load_plan(sensors, design, noise)
    return file if budget is None else replace(file, budget=budget)


def candidate_runs(
    file: PlanFile,
    speeds: Sequence[float],
    tracks: Sequence[str | Path],
    duration: float | None = None,
    *,
    seed: int | None = None,
    sections: int = 1,
) -> CandidateRuns:
    """Return the runs that may be made; ValueError where fewer than two can be planned."""
    from railui.planning import plan as planning

    return planning.candidate_runs(file, speeds, tracks, duration or DURATION, seed, sections)


def compute_plan(
    design: Design,
    file: PlanFile,
    runs: CandidateRuns,
    *,
    store: str | Path | None = None,
    cluster: Pool | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> Plan:
    """Compute a plan of runs that may be made, on a cluster or in this process; ValueError if the vehicle diverges."""
    from railui.planning.plan import plan_document, plan_of_runs
    from railui.planning.store import InformationStore

    kept = None if store is None else InformationStore(Path(store))
    found = plan_of_runs(file, runs, seed=seed, jobs=jobs, progress=progress, store=kept, cluster=cluster)
    files = (run.source.file for run in found.runs if run.source.file is not None)
    inputs = tuple(dict.fromkeys([*input_paths(design), file.campaign.source, *files]))
    warnings = tuple(file.campaign.warnings)
    return Plan(design, plan_document(found), inputs, seed, warnings=warnings)


def plan_of(
    design: Design,
    sensors: str | Path,
    speeds: Sequence[float | str],
    track: Tracks,
    *,
    duration: float = DURATION,
    sections: int = 1,
    noise: Mapping[str, float | str] | None = None,
    budget: float | None = None,
    seed: int | None = None,
    **options: Any,
) -> Plan:
    """Compute a plan; parameters, `options` and exceptions as `plan`."""
    from railui.io.units import read_speed

    tracks = [track] if isinstance(track, str | Path) else list(track)
    grid = [read_speed(v) if isinstance(v, str) else float(v) for v in speeds]
    file = read_plan_file(design, sensors, noise, budget)
    runs = candidate_runs(file, grid, tracks, duration, seed=seed, sections=sections)
    return compute_plan(design, file, runs, seed=seed, **options)


def plan(
    design: VehicleDesign | str | Path,
    sensors: str | Path,
    speeds: Sequence[float | str],
    track: Tracks,
    *,
    duration: float = DURATION,
    sections: int = 1,
    noise: Mapping[str, float | str] | None = None,
    budget: float | None = None,
    store: str | Path | None = None,
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
    store : str or Path, optional
        Directory of what was computed of every run; read again, a plan resumes.
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
    options: dict[str, Any] = {"sections": sections, "store": store, "seed": seed, "jobs": jobs, "progress": progress}
    found = plan_of(as_design(design), sensors, speeds, track, duration=duration, noise=noise, budget=budget, **options)
    return dict(found.data)
