"""Optimisation study: variables, cases, objectives and constraints; built of a file or of mappings."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from railui.api.design import Design, as_design
from railui.api.display import Summarised, SummaryRow
from railui.io.problems import FileProblems
from railui.optimisation.study import Study as SearchStudy
from railui.optimisation.study_reader import load_study
from railui.progress import SILENT, Progress
from railui.track import parse_spec
from railui.vehicle.design import Design as VehicleDesign

if TYPE_CHECKING:
    from railui.api.optimisation import Optimisation


@dataclass(frozen=True)
class Study(SearchStudy, Summarised):
    """Optimisation study of a vehicle.

    It is built by `load` or `build`.

    Attributes
    ----------
    name : str
    design : Design
        Vehicle whose parameters vary.
    variables : tuple of Variable
        Path, lowest, highest (SI) and unit of each.
    cases : Cases
        Tracks, speeds, seeds and scenarios on which every design is evaluated.
    objectives : tuple of Objective
    constraints : tuple of Constraint
    method : Method
        kind, population, generations, seed.
    warnings : tuple of Problem

    Examples
    --------
    >>> study = Study.load("designs/studies/test_bogie.yaml")
    >>> [objective.key for objective in study.objectives], study.method.kind
    (['weighted_acceleration', 'flange_margin'], 'nsga2')
    """

    _folder: object = field(default=None, compare=False, repr=False)  # removed with the study

    @classmethod
    def of(cls, study: SearchStudy) -> Self:
        """Return a study as this class."""
        if isinstance(study, cls):
            return study
        values = {item.name: getattr(study, item.name) for item in fields(SearchStudy)}
        return cls(**values | {"design": Design.of(study.design)})

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a study and the vehicle that it names; FileProblems with every fault."""
        from railui.documents.recognise import expect_kind

        expect_kind(path, "study")
        return cls.of(load_study(path, check_track=parse_spec))

    @classmethod
    def build(
        cls,
        design: VehicleDesign | str | Path,
        variables: Mapping[str, tuple[float | str, float | str]],
        objectives: Sequence[Mapping[str, str]],
        *,
        track: str | Sequence[str],
        speed: float | str | Sequence[float | str],
        seed: int | Sequence[int] = 1,
        scenario: Sequence[Mapping[str, float | str]] | None = None,
        constraints: Sequence[str] = (),
        method: Mapping[str, str | int] | None = None,
        draws: int | None = None,
        radius: float | str | None = None,
        cant_deficiency: float | str | None = None,
        name: str = "study",
        directory: str | Path | None = None,
    ) -> Self:
        """Build a study.

        It is written as files, study.yaml and vehicle.yaml, with which `railui optimise` makes the same search. Without
        a directory they are temporary, and are removed with the object.

        Parameters
        ----------
        design : Design, str or Path
        variables : mapping
            Lowest and highest value by path: SI numbers, or quantities such as "3 MN/m".
        objectives : sequence of mapping
            {"minimise" or "maximise": key of the results, "over": "mean", "worst" or "p95"}.
        track : str or sequence of str
            Specs or files, relative to the directory.
        speed : float, str or sequence
            Speeds [m/s], or quantities.
        seed : int or sequence of int
        scenario : sequence of mapping, optional
            Changes of the vehicle by path; by default those of `railui optimise`.
        constraints : sequence of str
            Such as "linear_damping >= 0.05".
        method : mapping, optional
            kind, population, generations and seed.
        draws : int, optional
            Vehicles of the parameter samples of a calibrated design, of its covariance where it has none.
        radius, cant_deficiency : float or str, optional
            Curve of the results of `curve` [m].
        name : str
        directory : str or Path, optional
            Directory that the files are written to; it must not contain a study.

        Raises
        ------
        FileProblems
            With every problem, as of a study file.

        Examples
        --------
        >>> study = Study.build(
        ...     "designs/test_bogie.yaml",
        ...     {"vehicle.secondary.lateral_damping": ("10 kN*s/m", "100 kN*s/m")},
        ...     [{"minimise": "weighted_acceleration", "over": "mean"}],
        ...     track="erri_b176_low length=500",
        ...     speed="144 km/h",
        ... )
        >>> study.variables[0].highest, study.cases.speed
        (100000.0, (40.0,))
        """
        from railui.api.study_files import write_study_files

        cases = {
            "track": _listed(track),
            "speed": _listed(speed),
            "seed": _listed(seed),
            "scenario": scenario,
            "draws": draws,
            "radius": radius,
            "cant_deficiency": cant_deficiency,
        }
        folder = tempfile.TemporaryDirectory(prefix="railui-study-") if directory is None else None
        home = Path(directory if folder is None else folder.name)  # type: ignore[arg-type]
        content = {
            "variables": {path: list(ends) for path, ends in variables.items()},
            "cases": {key: value for key, value in cases.items() if value is not None},
            "objectives": [dict(objective) for objective in objectives],
            "constraints": list(constraints),
            "method": method,
        }
        file = write_study_files(home, name, as_design(design), content)
        try:
            return replace(cls.of(load_study(file, check_track=parse_spec)), _folder=folder)
        except FileProblems:
            file.unlink()  # so that the corrected call may use the directory
            raise

    def optimise(
        self,
        directory: str | Path | None = None,
        *,
        seed: int | None = None,
        jobs: int | None = None,
        progress: Progress = SILENT,
        samples: int = 0,
    ) -> Optimisation:
        """Search the variables for better designs, as `railui optimise`.

        Parameters
        ----------
        directory : str or Path, optional
            Directory of the result, in which every evaluation is stored as it completes: the same call resumes an
            interrupted search, with the same result. Without it nothing is written.
        seed : int, optional
            Seed instead of that of the study's method.
        jobs : int, optional
            Threads; all processors by default.
        progress : Progress
            Receives a message and a `SearchState` after every generation.
        samples : int
            Samples of Sobol's indices, a power of two; 0 for none.

        Raises
        ------
        FileProblems
            For objectives that the cases cannot evaluate, and a directory with other files.
        """
        from railui.api.optimisation import run_search

        study = self if seed is None else replace(self, method=replace(self.method, seed=seed))
        return run_search(study, directory, jobs=jobs, progress=progress, samples=samples)

    def summary_title(self) -> str:
        """Return the name."""
        return f"study {self.name}"

    def summary_rows(self) -> list[SummaryRow]:
        """Return the vehicle, the variables with their ranges, objectives, constraints and method."""
        ranges = [SummaryRow(v.path, [v.lowest, v.highest], v.unit) for v in self.variables]
        aims = [SummaryRow(o.sense, f"{o.key}, {o.over}") for o in self.objectives]
        limits = [SummaryRow("constraint", constraint.text) for constraint in self.constraints]
        method = f"{self.method.kind}, {self.method.population} designs, {self.method.generations} generations"
        return [SummaryRow("vehicle", self.design.name), *ranges, *aims, *limits, SummaryRow("method", method)]

    def summary_notes(self) -> Sequence[str]:
        """Return the warnings."""
        return [str(problem) for problem in self.warnings]


def _listed(value: Any) -> list[Any]:
    return [value] if isinstance(value, str | int | float) else list(value)
