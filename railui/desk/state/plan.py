"""A search as it is set up on the desk: variables with bounds, aims, limits, cases, method; and its study file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from railui.desk.state.draft import DECADE, Field
from railui.desk.widgets.form import Head
from railui.documents.saving import save_design
from railui.io.atomic import write_text
from railui.io.number_format import display, unit_text
from railui.io.problems import FileProblems
from railui.io.units import quantity, read_speed
from railui.io.yaml_writer import flow
from railui.optimisation.response_keys import NUMBERS as KNOWN
from railui.optimisation.response_keys import RESULTS
from railui.optimisation.study import Study, load_study
from railui.track import parse_spec
from railui.vehicle.design_reader import Design
from railui.vehicle.parameters import PARAMETERS

FIRST: Final = ("vehicle.primary.lateral_stiffness", "vehicle.primary.longitudinal_stiffness",
                "vehicle.secondary.lateral_damping", "vehicle.secondary.yaw_damping")  # fmt: skip
REACH: Final = 4.0  # a variable may first go to so many times its value, or to that part of it
OVER: Final = ("mean", "worst", "p95")
USUAL, NONE, OWN = "usual", "none", "as the study says"
BETTER_MORE: Final = ("score", "comfort_hours", "flange_margin", "linear_damping", "linear_critical_speed",
                      "fold_speed", "practical_critical_speed")  # fmt: skip
AIMS: Final = tuple(f"{'maximise' if key in BETTER_MORE else 'minimise'} {key}" for key in KNOWN)


@dataclass(frozen=True)
class Plan:
    """What is searched. Bounds and speed in SI; aims are ("minimise weighted_acceleration", "mean")."""

    design: Design
    bounds: dict[str, tuple[float, float]]
    aims: tuple[tuple[str, str], ...] = (
        ("minimise weighted_acceleration", "mean"),
        ("maximise flange_margin", "worst"),
    )
    limits: tuple[str, ...] = ("linear_damping >= 0.05",)
    track: str = "erri_b176_low length=2000"
    speed: float = 40.0
    seeds: str = "1, 2"
    scenarios: str = USUAL
    kind: str = ""
    population: int = 64
    generations: int = 20
    seed: int = 1
    directory: str = ""
    study: Study | None = field(default=None, compare=False)

    @classmethod
    def of(cls, design: Design, track: str, speed: float) -> Plan:
        """A first plan for a design: its usual springs and dampers."""
        springs = [p for p in FIRST if design.values.get(p, 0.0) > 0]
        if not springs:  # of bodies and elements: the first that it has
            ends = ("_stiffness", "_damping")
            springs = [p for p, value in design.values.items() if p.endswith(ends) and value > 0][: len(FIRST)]
        bounds = {path: first_bounds(design, path) for path in springs}
        name = design.source.stem if design.source else "design"
        told = " ".join(word for word in track.split() if not word.startswith("seed="))
        return cls(design, bounds, track=told, speed=speed, directory=f"railui-study/{name}")

    @classmethod
    def read(cls, path: Path) -> Plan:
        """The plan of a study file; FileProblems with every fault. What the desk has no line for stays as it is."""
        study = load_study(path, check_track=parse_spec)
        c, m = study.cases, study.method
        return cls(
            study.design,
            {v.path: (v.lowest, v.highest) for v in study.variables},
            tuple((f"{a.sense} {a.key}", a.over) for a in study.objectives),
            tuple(limit.text for limit in study.constraints),
            c.track[0], c.speed[0], ", ".join(map(str, c.seed)), OWN, m.kind, m.population, m.generations, m.seed,
            str(path.parent / "railui-study" / path.stem), study,
        )  # fmt: skip

    # the form

    def rows(self) -> Iterator[Head | Field]:
        """Its lines."""
        yield Head("variables: a adds, Delete removes")
        for path, (low, high) in self.bounds.items():
            yield Head(path.removeprefix("vehicle.").replace(".", " ").replace("_", " "))
            yield self._number(f"bounds.{path}.lowest", "lowest", self._unit(path), low, *self._reach(path))
            yield self._number(f"bounds.{path}.highest", "highest", self._unit(path), high, *self._reach(path))
        yield Head("aims")
        for i, (aim, over) in enumerate(self.aims):
            choices = AIMS if aim in AIMS else (*AIMS, aim)
            yield Field(f"aims.{i}.aim", "", f"aim {i + 1}", "", aim, 0, 1, False, "", choices)
            told = f"aim {i + 1}, of all cases their"
            yield Field(f"aims.{i}.over", "", told, "", over, 0, 1, False, "", OVER)
        yield Head("limits")
        for i, limit in enumerate(self.limits):
            yield Field(
                f"limits.{i}", "", "a limit such as linear_damping >= 0.05", "", limit, 0, 1, False, "", title="limit"
            )
        yield Field("limits.new", "", "one limit more; empty: none", "", "", 0, 1, False, "", title="one more")
        yield Head("cases")
        yield Field("track", "", "track: a spec or a file", "", self.track, 0, 1, False, "")
        yield self._number("speed", "speed", "m/s", self.speed, 5.0, 100.0)
        yield Field("seeds", "", "seeds of the track", "", self.seeds, 0, 1, False, "")
        choices = (USUAL, NONE) if self.study is None else (OWN, USUAL, NONE)
        told = "scenarios: usual are low, own and high conicity, low and high friction"
        yield Field("scenarios", "", told, "", self.scenarios, 0, 1, False, "", choices)
        yield Head("method")
        yield self._number("population", "designs of a generation", "1", self.population, 8, 512)
        yield self._number("generations", "generations", "1", self.generations, 1, 200)
        yield self._number("seed", "seed of the search", "1", self.seed, 0, 100)
        yield Field("directory", "", "where every evaluation is kept", "", self.directory, 0, 1, False, "")

    def _number(self, path: str, caption: str, unit: str, value: float, low: float, high: float) -> Field:
        return Field(path, "", caption, unit, value, low, high, False, "")

    def _unit(self, path: str) -> str:
        return self.design.unit(path)

    def _reach(self, path: str) -> tuple[float, float]:
        low, high = self.design.parameter(path).usual
        ends = (*self.bounds[path], self.design.value(path))
        low, high = min(low, *ends), max(high if high < 1e15 else 10 * max(ends), *ends)
        return (max(low, high / 1e4) if low >= 0 and high > DECADE * max(low, 1e-12) else low), high

    def changed(self, path: str, value: Any) -> Plan:
        """The plan with another value at a path of its form; ValueError where it does not fit."""
        head, _, rest = path.partition(".")
        if head == "bounds":
            name, _, end = rest.rpartition(".")
            number = PARAMETERS[name].read(value) if name in PARAMETERS else quantity(value, self._unit(name))
            low, high = self.bounds[name]
            pair = (number, high) if end == "lowest" else (low, number)
            if not pair[0] < pair[1]:
                raise ValueError(
                    f"{display(pair[0], self._unit(name))} is not below {display(pair[1], self._unit(name))}"
                )
            return replace(self, bounds=self.bounds | {name: pair})
        if head == "aims":
            i, key = rest.split(".")
            aims = [list(aim) for aim in self.aims]
            aims[int(i)][0 if key == "aim" else 1] = value
            return replace(self, aims=tuple((a, o) for a, o in aims))
        if head == "limits":
            limits = list(self.limits)
            limits = [*limits, ""] if rest == "new" else limits
            limits[-1 if rest == "new" else int(rest)] = str(value).strip()
            return replace(self, limits=tuple(limit for limit in limits if limit))
        if head == "speed":
            return replace(self, speed=read_speed(value))
        if head in ("population", "generations", "seed"):
            number = round(float(value))
            least = {"population": 4, "generations": 1, "seed": 0}[head]
            if number < least:
                raise ValueError(f"{head} is at least {least}")
            return replace(self, **{head: number})  # type: ignore[arg-type]
        return replace(self, **{head: str(value)})  # type: ignore[arg-type]

    def with_variable(self, path: str) -> Plan:
        """One variable more, with its first bounds."""
        return replace(self, bounds=self.bounds | {path: first_bounds(self.design, path)})

    def without(self, path: str) -> Plan:
        """Without the variable, aim or limit that a line of the form is of."""
        head, _, rest = path.partition(".")
        if head == "bounds" and len(self.bounds) > 1:
            return replace(self, bounds={p: b for p, b in self.bounds.items() if p != rest.rpartition(".")[0]})
        if head == "aims" and len(self.aims) > 1:
            return replace(self, aims=tuple(a for i, a in enumerate(self.aims) if i != int(rest.split(".")[0])))
        if head == "limits" and rest != "new":
            return replace(self, limits=tuple(one for i, one in enumerate(self.limits) if i != int(rest)))
        return self

    def with_aim(self) -> Plan:
        """One aim more."""
        known = [aim for aim, _ in self.aims]
        free = next((aim for aim in AIMS if aim not in known), None)
        return self if free is None else replace(self, aims=(*self.aims, (free, "mean")))

    # the study

    def text(self, vehicle: Path) -> str:
        """The plan as a study file."""
        told = self.study.cases if self.study is not None else None
        tracks, speeds = [self.track], [self.speed]
        if told is not None:
            tracks = [self.track, *told.track[1:]]
            speeds = [self.speed, *told.speed[1:]]
        tracks = [self._track(track) for track in tracks]
        lines = ["schema: railui.study/1", f"name: {flow(Path(self.directory).name)}", f"vehicle: {flow(str(vehicle))}"]
        lines += ["variables:", *(f"  {path}: {flow(list(pair))}" for path, pair in self.bounds.items())]
        lines += ["cases:", f"  track: {flow(tracks)}", f"  speed: {flow(speeds)}", f"  seed: [{self.seeds}]"]
        if self.scenarios == NONE:
            lines.append("  scenario: [{}]")
        elif self.scenarios == OWN and told is not None:
            lines.append(f"  scenario: {flow([dict(s) for s in told.scenario])}")
        if told is not None:
            lines += [
                f"  draws: {told.draws}",
                f"  radius: {flow(told.radius)}",
                f"  cant_deficiency: {flow(told.cant_deficiency)}",
            ]
        lines.append("objectives:")
        for aim, over in self.aims:
            sense, key = aim.split()
            lines.append(f"  - {flow({sense: key, 'over': over})}")
        lines.append(f"constraints: {flow(list(self.limits))}")
        method = {"population": self.population, "generations": self.generations, "seed": self.seed}
        kind = {"kind": self.kind} if self.kind and (len(self.aims) > 1) == self.kind.startswith("nsga") else {}
        return "\n".join([*lines, f"method: {flow(kind | method)}"]) + "\n"

    def resolved(self) -> Study:
        """The study, checked, as files beside the directory of its search; FileProblems with every fault."""
        directory = Path(self.directory).expanduser()
        vehicle = save_design(self.design, directory.with_name(f"{directory.name}.vehicle.yaml").resolve())
        source = write_text(directory.with_name(f"{directory.name}.study.yaml"), self.text(vehicle))
        return load_study(source, check_track=parse_spec)

    def _track(self, track: str) -> str:
        """A track that is a file by its whole path, for the study file stands elsewhere."""
        home = self.study.directory if self.study is not None else Path.cwd()
        beside = home / track if len(track) < 400 else home
        return str(beside.resolve()) if beside.is_file() else track


def first_bounds(design: Design, path: str) -> tuple[float, float]:
    """Where a variable may first go: a few times its value either way, inside the range of real vehicles."""
    p, value = design.parameter(path), design.value(path)
    low, high = value / REACH, value * REACH
    if value <= 0:
        low, high = p.usual
    rounded = (float(f"{low:.2g}"), float(f"{high:.2g}"))
    return (max(rounded[0], p.minimum), min(rounded[1], p.maximum))


def variables(design: Design) -> list[tuple[str, str]]:
    """What may be varied: key, line to show."""
    found = []
    for path in design.paths():
        try:
            p = design.parameter(path)
        except FileProblems:
            continue
        found.append((path, f"{path:44} {p.caption}"))
    return found


def aim_unit(aim: str) -> str:
    """The unit of an aim, as it is printed."""
    return unit_text(RESULTS[aim.split()[-1]].unit)
