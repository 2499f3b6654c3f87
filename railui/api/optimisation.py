"""Result of an optimisation: front, knee point, baseline; and the search in a directory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from railui.api.design import Design
from railui.api.display import Summarised, SummaryRow, draw_on
from railui.api.document import json_document
from railui.api.study import Study
from railui.execution.outputs import REPORT_FILE, check_choice
from railui.execution.session import Session
from railui.execution.tasks import Runner
from railui.execution.threads import ThreadRunner
from railui.optimisation.cases import has_seeds
from railui.optimisation.cases import used_seeds as used_seeds
from railui.optimisation.fresh import FRESH_SEED_SETS as FRESH_SEED_SETS
from railui.optimisation.fresh import is_significant as is_significant
from railui.optimisation.optimise import checked_cases, optimise
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.optimisation.study import Study as SearchStudy
from railui.progress import SILENT, Progress
from railui.track.excitation import is_track_file

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


class FrontDesign(NamedTuple):
    """Design of the front, or the baseline.

    Attributes
    ----------
    variables : mapping
        Values by path, SI.
    objectives, constraints : tuple of float or None
        In the order of the study, constraints of the worst case.
    fresh_mean, fresh_sd : tuple of float or None
        Mean and standard deviation of the objectives over sets of seeds that the search did not use.
    fresh_failed : int or None
        Number of these sets in which the design failed.
    fresh_met : tuple of int or None
        Number of these sets in which the design meets each constraint.
    """

    variables: Mapping[str, float]
    objectives: tuple[float | None, ...]
    constraints: tuple[float | None, ...]
    fresh_mean: tuple[float | None, ...]
    fresh_sd: tuple[float | None, ...]
    fresh_failed: int | None
    fresh_met: tuple[int | None, ...]


@dataclass(frozen=True, eq=False)
class Optimisation(Summarised):
    """Result of a search; `Study.optimise` computes it.

    Attributes
    ----------
    study : Study
    data : mapping
        The result of `railui.optimise`.
    inputs : tuple of Path
        Files that were read.
    """

    study: Study
    data: Mapping[str, Any] = field(repr=False)
    inputs: tuple[Path, ...] = ()

    @property
    def front(self) -> tuple[FrontDesign, ...]:
        """Designs of the Pareto front, ordered by the first objective; empty if none meets the constraints."""
        return tuple(map(_front_design, self.data["pareto"]))

    @property
    def knee(self) -> int | None:
        """Index of the knee point in the front; None without a front."""
        knee: int | None = self.data["knee"]
        return knee

    @property
    def baseline(self) -> FrontDesign:
        """The unchanged vehicle."""
        return _front_design(self.data["baseline"])

    @property
    def evaluations(self) -> int:
        """Number of designs that were evaluated."""
        return int(self.data["evaluations"])

    @property
    def objectives(self) -> tuple[str, ...]:
        """Objectives in words, such as "minimise weighted_acceleration, mean"."""
        return tuple(f"{aim['sense']} {aim['key']}, {aim['over']}" for aim in self.data["aims"])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the study and its result."""
        return tuple(self.data["warnings"])

    @property
    def units(self) -> dict[str, str]:
        """Unit of each variable and objective."""
        units = {variable.path: variable.unit for variable in self.study.variables}
        aims = zip(self.objectives, self.data["aims"], strict=True)
        return units | {name: RESPONSE_KEYS[aim["key"]].unit for name, aim in aims}

    def design(self, number: int | None = None) -> Design:
        """Return a design of the front as a vehicle, by default that at the knee point.

        Raises
        ------
        IndexError
            For a number that the front has not, and without a front.
        """
        index = self.knee if number is None else number
        if index is None or not -len(self.front) <= index < len(self.front):
            raise IndexError(f"the front has {len(self.front)} designs, there is no number {index}")
        return Design.of(self.study.design).with_values(dict(self.front[index].variables))

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON document that `railui optimise` writes: every number finite or None."""
        return json_document("optimise", self.data, self.inputs, self.study.method.seed)

    def to_frame(self) -> pandas.DataFrame:
        """Return the front, a column for each variable, objective and constraint; ImportError without pandas."""
        from railui.api.frames import frame_of_rows

        limits = list(self.data["limits"])
        rows = [
            dict(one.variables)
            | dict(zip(self.objectives, one.objectives, strict=True))
            | dict(zip(limits, one.constraints, strict=True))
            for one in self.front
        ]
        return frame_of_rows(rows, self.units)

    def plot_front(self, ax: Axes | None = None, *, objective: int = 1) -> Axes:
        """Draw an objective, by its number, against the first: front, knee point and baseline."""
        from railui.report.search.figures import draw_front

        if not 0 < objective < len(self.objectives):
            raise ValueError(f"there are {len(self.objectives)} objectives: draw number 1 or higher against number 0")
        return draw_on(ax, lambda on: draw_front(on, self.data, objective), (4.7, 3.4))

    def plot_hypervolume(self, ax: Axes | None = None) -> Axes:
        """Draw the hypervolume of the front against the number of evaluations."""
        from railui.report.search.figures import draw_hypervolume

        return draw_on(ax, lambda on: draw_hypervolume(on, self.data), (4.7, 2.6))

    def summary_title(self) -> str:
        """Return the study and the size of its front."""
        count = len(self.front)
        return f"{self.study.name}: {count} design{'' if count == 1 else 's'} on the Pareto front"

    def summary_rows(self) -> list[SummaryRow]:
        """Return each objective and constraint of the baseline and of the knee point, and the knee's variables."""
        points = {"baseline": self.baseline} | ({} if self.knee is None else {"knee": self.front[self.knee]})
        names = [*self.objectives, *self.data["limits"]]
        rows = [
            SummaryRow(f"{point}: {name}", value)
            for point, one in points.items()
            for name, value in zip(names, [*one.objectives, *one.constraints], strict=True)
        ]
        if self.knee is not None:
            rows += [SummaryRow(path, x, self.units[path]) for path, x in self.front[self.knee].variables.items()]
        return rows

    def summary_notes(self) -> Sequence[str]:
        """Return the warnings."""
        return self.warnings


def _front_design(point: Mapping[str, Any]) -> FrontDesign:
    fresh = point["fresh"]
    return FrontDesign(
        variables=dict(point["variables"]),
        objectives=tuple(point["objectives"]),
        constraints=tuple(point["constraints"]),
        fresh_mean=tuple(fresh["mean"]),
        fresh_sd=tuple(fresh["sd"]),
        fresh_failed=fresh["failed"],
        fresh_met=tuple(fresh["met"]),
    )


def run_search(
    study: Study,
    directory: str | Path | None = None,
    *,
    jobs: int | None = None,
    progress: Progress = SILENT,
    samples: int = 0,
) -> Optimisation:
    """Search a study, in a directory if one is named; parameters and exceptions as `Study.optimise`."""
    inputs = study_inputs(study)
    if directory is None:
        return Optimisation(study, optimise(study, jobs=jobs, progress=progress, samples=samples), inputs)
    data, _ = search_in_directory(study, directory, ThreadRunner(jobs), jobs=jobs, progress=progress, samples=samples)
    return Optimisation(study, data, inputs)


def search_in_directory(
    study: SearchStudy,
    directory: str | Path,
    runner: Runner,
    *,
    unlock: bool = False,
    jobs: int | None = None,
    samples: int = 0,
    choose: Sequence[int] = (),
    inputs: Sequence[str | Path] | None = None,
    progress: Progress = SILENT,
    warnings: Progress | None = None,
) -> tuple[dict[str, Any], list[Path]]:
    """Run or resume the search of a study in a directory and write its files.

    Parameters
    ----------
    study : Study
    directory : str or Path
    runner : Runner
        Threads or machines that evaluate the designs.
    unlock : bool
        Take over the directory from a process that ended on another machine.
    jobs : int, optional
        Threads of the evaluation on this machine.
    samples : int
        Samples of Sobol's indices, a power of two; 0 for none.
    choose : sequence of int
        Numbers of designs of the front to write as design files.
    inputs : sequence, optional
        Files that were read, as the result names them.
    progress, warnings : Progress
        Receivers of the progress of the search, and of warnings about the directory.

    Returns
    -------
    dict
        The result of `railui.optimise`.
    list of Path
        Files that were written.

    Raises
    ------
    FileProblems
        For objectives that the cases cannot evaluate, and a directory with other files.
    ValueError
        For a number in `choose` that the front has not, after all files are written.
    """
    from railui.report.search.page import write_study_page

    home = Path(directory)
    with Session(study, home, runner, unlock=unlock, progress=warnings or progress) as session:
        data = optimise(
            study, jobs=jobs, progress=session.progress(progress), evaluator=session.evaluator, samples=samples
        )
        files = study_inputs(study) if inputs is None else inputs
        document = json_document("optimise", data, files, study.method.seed)
        written = [*session.finish(document, choose), write_study_page(study, document, home / REPORT_FILE)]
    check_choice(document, choose, home)
    return data, written


class SearchSize(NamedTuple):
    """Size of a search: designs to evaluate, cases of each, time steps of all, and whether a track has a seed."""

    designs: int
    cases: int
    steps: int
    has_seeds: bool


def search_size(study: SearchStudy) -> SearchSize:
    """Return the size of a search before it runs; FileProblems for objectives that the cases cannot evaluate."""
    cases = checked_cases(study)
    designs = study.method.population * study.method.generations
    steps = designs * sum(len(case.excitation.track) for case in cases)
    return SearchSize(designs, len(cases), steps, has_seeds(cases))


def study_inputs(study: SearchStudy) -> tuple[Path, ...]:
    """Return the files of a study: its own, that of the vehicle and those of the tracks."""
    tracks = [study.directory / track for track in study.cases.track]
    files = [path for path in tracks if is_track_file(path) and path.is_file()]
    return (study.source, *((study.design.source,) if study.design.source is not None else ()), *files)
