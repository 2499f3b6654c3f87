"""Search plan: variables with bounds, objectives, constraints, cases, method; and its study file."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from railui.api.optimisation import used_seeds
from railui.desk.state.form_rows import LOG_SCALE_RATIO, UNBOUNDED
from railui.documents.saving import save_design
from railui.io.atomic import write_text
from railui.io.number_format import format_quantity, typeset_unit
from railui.io.schema_line import schema_name
from railui.io.units import quantity, read_speed
from railui.io.yaml_writer import YamlWriter
from railui.optimisation.response_keys import NUMERIC_KEYS as KNOWN_KEYS
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.optimisation.study import Study
from railui.optimisation.study_reader import CONSTRAINT_PATTERN, fixed_transfer_warnings, load_study
from railui.track import parse_spec
from railui.vehicle.design_reader import Design
from railui.vehicle.parameters import PARAMETERS

DEFAULT_VARIABLES: Final = (
    "vehicle.primary.lateral_stiffness",
    "vehicle.primary.longitudinal_stiffness",
    "vehicle.secondary.lateral_damping",
    "vehicle.secondary.yaw_damping",
)
DEFAULT_BOUNDS_FACTOR: Final = 4.0  # default bounds: a quarter and four times the value
MAXIMISED_KEYS: Final = (
    "score",
    "comfort_hours",
    "flange_margin",
    "linear_damping",
    "linear_critical_speed",
    "fold_speed",
    "practical_critical_speed",
)
OBJECTIVES: Final = tuple(f"{'maximise' if key in MAXIMISED_KEYS else 'minimise'} {key}" for key in KNOWN_KEYS)
USUAL_SCENARIOS: Final = "usual"
NO_SCENARIOS: Final = "none"
STUDY_SCENARIOS: Final = "as in the study file"
INTEGER_MINIMA: Final = {"population": 4, "generations": 1, "seed": 0}
MAX_FILE_NAME: Final = 400  # characters; a longer track is a spec


@dataclass(frozen=True)
class Plan:
    """Plan of a search. Bounds and speed in SI; an objective is ("minimise weighted_acceleration", "mean")."""

    design: Design
    bounds: dict[str, tuple[float, float]]
    objectives: tuple[tuple[str, str], ...] = (
        ("minimise weighted_acceleration", "mean"),
        ("maximise flange_margin", "worst"),
    )
    constraints: tuple[str, ...] = ("linear_damping >= 0.05",)
    track: str = "erri_b176_low length=2000"
    speed: float = 40.0
    seeds: str = "1, 2"
    scenarios: str = USUAL_SCENARIOS
    kind: str = ""
    population: int = 64
    generations: int = 20
    seed: int = 1
    directory: str = ""
    study: Study | None = field(default=None, compare=False)

    @classmethod
    def for_design(cls, design: Design, track: str, speed: float) -> Plan:
        """Return a default plan that varies the springs and dampers of a design that its comfort follows."""
        springs = [p for p in DEFAULT_VARIABLES if design.values.get(p, 0.0) > 0]
        if not springs:  # a vehicle of bodies and elements
            ends = ("_stiffness", "_damping")
            springs = [p for p, value in design.values.items() if p.endswith(ends) and value > 0]
        keys = [objective.split()[-1] for objective, _ in cls.objectives]
        idle = {path for path, *_ in fixed_transfer_warnings(design, springs, keys)}
        springs = [path for path in springs if path not in idle] or springs
        bounds = {path: default_bounds(design, path) for path in springs[: len(DEFAULT_VARIABLES)]}
        name = design.source.stem if design.source else "design"
        spec = " ".join(word for word in track.split() if not word.startswith("seed="))
        return cls(design, bounds, track=spec, speed=speed, directory=f"railui-study/{name}")

    @classmethod
    def read(cls, path: Path) -> Plan:
        """Read the plan of a study file; raise FileProblems with every error.

        Parts of the study that the form does not show stay as they are.
        """
        study = load_study(path, check_track=parse_spec)
        cases, method = study.cases, study.method
        return cls(
            study.design,
            {v.path: (v.lowest, v.highest) for v in study.variables},
            tuple((f"{objective.sense} {objective.key}", objective.over) for objective in study.objectives),
            tuple(constraint.text for constraint in study.constraints),
            cases.track[0],
            cases.speed[0],
            ", ".join(map(str, (cases.has_default_seed and used_seeds(study)) or cases.seed)),
            STUDY_SCENARIOS,
            method.kind,
            method.population,
            method.generations,
            method.seed,
            str(path.parent / "railui-study" / path.stem),
            study,
        )

    @property
    def file_stem(self) -> str:
        """Name of the plan in the names of files."""
        return Path(self.directory).name or "design"

    def warnings(self) -> list[str]:
        """Return the warnings on variables that comfort does not follow."""
        matches = [CONSTRAINT_PATTERN.match(text) for text in self.constraints]
        keys = [*(objective.split()[-1] for objective, _ in self.objectives), *(m[1] for m in matches if m)]
        return [
            f"{path} {what}: {remedy}" for path, what, remedy in fixed_transfer_warnings(self.design, self.bounds, keys)
        ]

    def unit(self, path: str) -> str:
        """Return the unit of a variable."""
        return self.design.unit(path)

    def slider_range(self, path: str) -> tuple[float, float]:
        """Return the range of the sliders of a variable's bounds."""
        low, high = self.design.parameter(path).usual_range
        values = (*self.bounds[path], self.design.value(path))
        low, high = min(low, *values), max(high if high < UNBOUNDED else 10 * max(values), *values)
        is_wide = low >= 0 and high > LOG_SCALE_RATIO * max(low, 1e-12)
        return (max(low, high / 1e4) if is_wide else low), high

    # changes

    def with_value(self, path: str, value: Any) -> Plan:
        """Return the plan with another value at a path of its form; raise ValueError if it is rejected."""
        head, _, rest = path.partition(".")
        if head == "bounds":
            name, _, end = rest.rpartition(".")
            return self._with_bound(name, end, value)
        if head == "objectives":
            index, _, key = rest.partition(".")
            return self._with_objective(index, key, value)
        if head == "constraints":
            return self._with_constraint(rest, str(value).strip())
        if head == "track":
            return replace(self, track=self._checked_track(str(value).strip()))
        if head == "speed":
            return replace(self, speed=read_speed(value))
        if head in INTEGER_MINIMA:
            number = round(float(value))
            if number < INTEGER_MINIMA[head]:
                raise ValueError(f"{head} must be at least {INTEGER_MINIMA[head]}")
            return replace(self, **{head: number})  # type: ignore[arg-type]
        return replace(self, **{head: str(value)})  # type: ignore[arg-type]

    def _with_bound(self, name: str, end: str, value: Any) -> Plan:
        number = PARAMETERS[name].read(value) if name in PARAMETERS else quantity(value, self.unit(name))
        low, high = self.bounds[name]
        low, high = (number, high) if end == "lowest" else (low, number)
        if not low < high:
            raise ValueError(
                f"{format_quantity(low, self.unit(name))} is not below {format_quantity(high, self.unit(name))}"
            )
        return replace(self, bounds=self.bounds | {name: (low, high)})

    def _checked_track(self, track: str) -> str:
        """Return a track that is a file or a valid spec; raise ValueError otherwise."""
        if not Path(self._absolute_track(track)).is_absolute():
            parse_spec(track)
        return track

    def _with_objective(self, index: str, key: str, value: str) -> Plan:
        objectives = list(self.objectives)
        objective, over = objectives[int(index)]
        objectives[int(index)] = (value, over) if key == "objective" else (objective, value)
        return replace(self, objectives=tuple(objectives))

    def _with_constraint(self, index: str, text: str) -> Plan:
        constraints = list(self.constraints)
        if index == "new":
            constraints.append(text)
        else:
            constraints[int(index)] = text
        return replace(self, constraints=tuple(constraint for constraint in constraints if constraint))

    def with_variable(self, path: str) -> Plan:
        """Return the plan with one more variable and its default bounds."""
        return replace(self, bounds=self.bounds | {path: default_bounds(self.design, path)})

    def with_objective(self) -> Plan:
        """Return the plan with one more objective."""
        used = [objective for objective, _ in self.objectives]
        unused = next((objective for objective in OBJECTIVES if objective not in used), None)
        return self if unused is None else replace(self, objectives=(*self.objectives, (unused, "mean")))

    def without(self, path: str) -> Plan:
        """Return the plan without the variable, objective or constraint at a path of its form."""
        head, _, rest = path.partition(".")
        if head == "bounds" and len(self.bounds) > 1:
            return replace(self, bounds={p: b for p, b in self.bounds.items() if p != rest.rpartition(".")[0]})
        if head == "objectives" and len(self.objectives) > 1:
            index = int(rest.split(".")[0])
            return replace(self, objectives=(*self.objectives[:index], *self.objectives[index + 1 :]))
        if head == "constraints" and rest != "new":
            index = int(rest)
            return replace(self, constraints=(*self.constraints[:index], *self.constraints[index + 1 :]))
        return self

    # the study file

    def study_text(self, vehicle: Path) -> str:
        """Return the plan as the text of a study file."""
        writer = YamlWriter()
        writer.entry("schema", schema_name("study"))
        writer.entry("name", Path(self.directory).name)
        writer.entry("vehicle", str(vehicle))
        with writer.block("variables"):
            for path, pair in self.bounds.items():
                writer.entry(path, list(pair))
        with writer.block("cases"):
            self._write_cases(writer)
        pairs = [(objective.split(), over) for objective, over in self.objectives]
        writer.items("objectives", [{sense: key, "over": over} for (sense, key), over in pairs])
        writer.entry("constraints", list(self.constraints))
        method: dict[str, Any] = {"population": self.population, "generations": self.generations, "seed": self.seed}
        if self.kind and (len(self.objectives) > 1) == self.kind.startswith("nsga"):
            method = {"kind": self.kind} | method
        writer.entry("method", method)
        return writer.text()

    def _write_cases(self, writer: YamlWriter) -> None:
        cases = self.study.cases if self.study is not None else None
        tracks = [self.track, *(cases.track[1:] if cases is not None else ())]
        writer.entry("track", [self._absolute_track(track) for track in tracks])
        writer.entry("speed", [self.speed, *(cases.speed[1:] if cases is not None else ())])
        writer.line(f"seed: [{self.seeds}]")  # the text of the form
        if self.scenarios == NO_SCENARIOS:
            writer.entry("scenario", [{}])
        elif self.scenarios == STUDY_SCENARIOS and cases is not None:
            writer.entry("scenario", [dict(s) for s in cases.scenario])
        if cases is not None:
            writer.entry("draws", cases.draws)
            writer.entry("radius", cases.radius)
            writer.entry("cant_deficiency", cases.cant_deficiency)

    def write_study(self) -> Study:
        """Write the study and its vehicle next to the directory of the search and return the checked study.

        Raises FileProblems with every error.
        """
        directory = Path(self.directory).expanduser()
        vehicle = save_design(self.design, directory.with_name(f"{directory.name}.vehicle.yaml").resolve())
        source = write_text(directory.with_name(f"{directory.name}.study.yaml"), self.study_text(vehicle))
        return load_study(source, check_track=parse_spec)

    def _absolute_track(self, track: str) -> str:
        """Return the absolute path of a track file, because the study file is in another directory."""
        home = self.study.directory if self.study is not None else Path.cwd()
        path = home / track if len(track) < MAX_FILE_NAME else home
        return str(path.resolve()) if path.is_file() else track


def default_bounds(design: Design, path: str) -> tuple[float, float]:
    """Return the default bounds of a variable: a quarter and four times its value, within the permitted range."""
    p, value = design.parameter(path), design.value(path)
    low, high = p.usual_range if value <= 0 else (value / DEFAULT_BOUNDS_FACTOR, value * DEFAULT_BOUNDS_FACTOR)
    return max(float(f"{low:.2g}"), p.minimum), min(float(f"{high:.2g}"), p.maximum)


def first_value(plan: Plan, first: Plan, path: str) -> Any:
    """Return the value that an entry of a plan had at first: for a variable added since, its default bound."""
    head, _, rest = path.partition(".")
    if head == "bounds":
        name, _, end = rest.rpartition(".")
        pair = first.bounds.get(name) or default_bounds(plan.design, name)
        return pair[0 if end == "lowest" else 1]
    if head == "objectives":
        index, _, key = rest.partition(".")
        known = int(index) < len(first.objectives)
        return first.objectives[int(index)][0 if key == "objective" else 1] if known else None
    if head == "constraints":
        known = rest.isdecimal() and int(rest) < len(first.constraints)
        return first.constraints[int(rest)] if known else None
    return getattr(first, head)


def objective_unit(objective: str) -> str:
    """Return the printed unit of an objective."""
    return typeset_unit(RESPONSE_KEYS[objective.split()[-1]].unit)
