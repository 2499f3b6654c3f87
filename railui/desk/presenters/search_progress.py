"""A search as far as it has come: its generations, the front, what is drawn of them, the spread on fresh seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.desk.state.plan import Plan, aim_unit
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bar
from railui.desk.widgets.picture import Line, Mark, Picture
from railui.io.number_format import display, pretty
from railui.optimisation.multi_objective import hypervolumes, knee, nondominated
from railui.optimisation.objectives import violations
from railui.optimisation.optimise import SearchState
from railui.vehicle.design_reader import Design


@dataclass(frozen=True, eq=False)
class Step:
    """A generation as the panel keeps it: designs, aims, which keep all limits, aims of the design as it is."""

    x: FloatArray
    aims: FloatArray
    kept: NDArray[np.bool_]
    evaluations: int
    failed: int
    doing: str
    baseline: FloatArray


class Searched:
    """A plan as it is searched: its generations, and its result once it has one."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.steps: list[Step] = []
        self.result: dict[str, Any] | None = None

    def take(self, step: Step) -> bool:
        """One generation more; False where nothing new was evaluated."""
        if self.steps and step.evaluations <= self.steps[-1].evaluations:
            return False
        self.steps.append(step)
        return True

    @property
    def share(self) -> float:
        """How much of the search is done, 0 .. 1."""
        return (self.steps[-1].evaluations if self.steps else 0) / (self.plan.population * self.plan.generations)

    @property
    def names(self) -> list[str]:
        """The aims in words."""
        return [aim.split()[-1].replace("_", " ") for aim, _ in self.plan.aims]

    def points(self) -> tuple[FloatArray, FloatArray]:
        """Designs [n, variable] of the front and their aims [n, aim]: the result's, or the best so far."""
        plan = self.plan
        if self.result is not None:
            found = self.result["pareto"]
            x = np.array([list(p["variables"].values()) for p in found]).reshape(len(found), -1)
            return x, _numbers([p["objectives"] for p in found], len(plan.aims))
        if not self.steps:
            return np.zeros((0, 0)), np.zeros((0, 2))
        x = np.vstack([step.x[step.kept] for step in self.steps])
        aims = np.vstack([step.aims[step.kept] for step in self.steps])
        if not len(aims):
            return x, aims
        better = aims * senses(plan)
        kept = np.flatnonzero(nondominated(better))
        order = kept[np.argsort(better[kept, 0], kind="stable")]
        return x[order], aims[order]

    def fresh(self, index: int) -> tuple[FloatArray, FloatArray] | None:
        """Mean and sd [aim] of a design of the front on seeds that the search never saw.

        None before the result, and where the tracks are files, which have no seeds.
        """
        if self.result is None or index >= len(self.result["pareto"]):
            return None
        told = self.result["pareto"][index]["fresh"]
        mean, sd = _numbers([told["mean"], told["sd"]], len(self.plan.aims))
        return (mean, sd) if np.all(np.isfinite(mean)) and np.all(np.isfinite(sd)) else None

    def values(self, index: int) -> dict[str, float] | None:
        """The variables of a design of the front by path."""
        x, _ = self.points()
        return dict(zip(self.plan.bounds, x[index].tolist(), strict=True)) if index < len(x) else None

    # what is drawn

    def design_rows(self) -> list[Bar]:
        """A row per design of the front: its aims, and where it lies between the best and the worst of the first."""
        _, aims = self.points()
        best = self.result["knee"] if self.result is not None else None
        if best is None and len(aims) > 1:
            best = knee(aims, senses(self.plan))
        width = float(np.ptp(aims[:, 0])) if len(aims) else 0.0
        rows = []
        for i, values in enumerate(aims):
            told = "  ".join(f"{value:8.4g}" for value in values)
            share = 1 - abs(values[0] - aims[0, 0]) / width if width else 1.0
            rows.append(Bar(f"{i + 1}{' knee' if i == best else ''}", float(share), told, strong=i == best))
        return rows

    def front_picture(self, at: int) -> Picture:
        """All designs tried, the front, the design as it is, and one of the front with its spread on fresh seeds."""
        if len(self.plan.aims) < 2:
            return Picture(Axis(""), Axis(""), wait="one aim: see the convergence")
        _, aims = self.points()
        axes = [Axis(name, aim_unit(aim)) for name, (aim, _) in zip(self.names, self.plan.aims, strict=True)]
        lines, marks = [], []
        tried = np.vstack([step.aims[step.kept] for step in self.steps]) if self.steps else np.zeros((0, 2))
        if len(tried):
            low, high = _frame(np.vstack([aims, tried]) if len(aims) else tried)
            near = np.all((tried[:, :2] >= low) & (tried[:, :2] <= high), axis=1)
            lines.append(Line(tried[near, 0], tried[near, 1], "tried", "base", points=True))
        lines.append(Line(aims[:, 0], aims[:, 1], "front", "now"))
        if self.steps and np.all(np.isfinite(self.steps[-1].baseline)):
            one = self.steps[-1].baseline
            marks.append(Mark(float(one[0]), float(one[1]), "x", "as it is", "other"))
            lines.append(Line(one[:1], one[1:2], "", "other", points=True))
        if at < len(aims):
            lines += self._spread(at)
            marks.append(Mark(float(aims[at, 0]), float(aims[at, 1]), "o", f"{at + 1}", "limit"))
        return Picture(axes[0], axes[1], lines, marks=marks)

    def _spread(self, at: int) -> list[Line]:
        """A cross of one standard deviation to each side of the mean on fresh seeds."""
        found = self.fresh(at)
        if found is None:
            return []
        (x, y), (dx, dy) = found[0][:2], found[1][:2]
        return [
            Line(np.array([x - dx, x + dx]), np.array([y, y]), "fresh seeds", "limit"),
            Line(np.array([x, x]), np.array([y - dy, y + dy]), "", "limit"),
        ]

    def convergence_picture(self) -> Picture:
        """The hypervolume, or the best of one aim, after every generation."""
        plan = self.plan
        if len(self.steps) < 2:
            return Picture(Axis(""), Axis(""), wait="after two generations")
        count = np.array([float(step.evaluations) for step in self.steps])
        if len(plan.aims) == 1:
            sense = senses(plan)
            best = sense[0] * np.array([np.min(s.aims[s.kept] * sense, initial=np.inf) for s in self.steps])
            return Picture(Axis("designs"), Axis(self.names[0], aim_unit(plan.aims[0][0])), [Line(count, best, "best")])
        volumes = hypervolumes([(s.evaluations, s.aims[s.kept] * senses(plan)) for s in self.steps])
        if not volumes:
            return Picture(Axis(""), Axis(""), wait="no design keeps all limits yet")
        y = np.array([one["hypervolume"] for one in volumes])
        return Picture(Axis("designs"), Axis("hypervolume", low=0.0, high=1.05), [Line(count, y, "")])

    # in words

    def told(self, index: int) -> str:
        """A design of the front: each variable beside what it is now."""
        values = self.values(index)
        return f"{index + 1}: {_told(self.plan.design, values)}" if values else ""

    def told_fresh(self, index: int) -> str:
        """Mean and sd of the aims of a design on fresh seeds, in one line."""
        found = self.fresh(index)
        if found is None:
            return "" if self.result is None else "no spread on fresh seeds: tracks of files have none"
        return f"fresh {', '.join(spread(mean, sd) for mean, sd in zip(*found, strict=True))}"

    def compared(self, index: int, width: int) -> str:
        """Per aim mean and sd on fresh seeds of a design, and where there is room what the search saw of it."""
        _, aims = self.points()
        found = self.fresh(index)
        if index >= len(aims) or found is None:
            return ""
        rows = []
        for name, value, mean, sd in zip(self.names, aims[index], *found, strict=True):
            told = f"{spread(mean, sd)} fresh"
            wide = f"{name[:21]:22}{told}, {value:.4g} searched"
            rows.append(wide if len(wide) <= width else f"{name[: width - len(told) - 1]:{width - len(told)}}{told}")
        return "\n".join(rows)


def spread(mean: float, sd: float) -> str:
    """A mean and its standard deviation, both to the second digit of that.

    >>> spread(0.149713, 0.00231)
    '0.1497±0.0023'
    """
    digits = max(0, 1 - int(np.floor(np.log10(sd)))) if sd > 0 else 4
    return f"{mean:.{digits}f}±{sd:.{digits}f}"


def _numbers(told: Sequence[Sequence[float | None]], width: int) -> FloatArray:
    """Rows of numbers as JSON has them, null as NaN."""
    return np.array([[np.nan if v is None else v for v in row] for row in told], dtype=float).reshape(-1, width)


def senses(plan: Plan) -> FloatArray:
    """1 for every aim of which less is better, -1 where more is."""
    return np.array([1.0 if aim.startswith("minimise") else -1.0 for aim, _ in plan.aims])


def step_of(study: Any, stand: SearchState) -> Step | None:
    """What the panel keeps of a generation; copied, for the search goes on."""
    one = stand.latest
    if one is None:
        return None
    kept = np.all(violations(study, one.judged) <= 0, axis=1)
    baseline = stand.baseline.objectives[0] if stand.baseline is not None else np.full(len(study.objectives), np.nan)
    return Step(
        one.x.copy(), one.judged.objectives.copy(), kept, stand.evaluations, stand.failed, stand.doing, baseline
    )


def _frame(aims: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Ends between which points are drawn: those far outside would hide the front."""
    low, high = np.nanpercentile(aims[:, :2], [0, 90], axis=0)
    spread = high - low
    return low - 0.5 * spread, high + 0.5 * spread


def _told(design: Design, values: dict[str, float]) -> str:
    """A design of the front in words: each variable beside what it is now."""
    parts = []
    for path, value in values.items():
        unit, name = design.unit(path), path.split(".")[-1].replace("_", " ")
        parts.append(f"{name} {pretty(display(value, unit, 3))} (is {pretty(display(design.value(path), unit, 3))})")
    return ", ".join(parts)
