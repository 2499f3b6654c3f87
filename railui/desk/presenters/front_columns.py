"""Quantities of the designs on a front: objectives, variables and constraints with their limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.desk.presenters.search_history import SearchHistory
from railui.desk.state.form_rows import symbol_text
from railui.desk.widgets.table import Column
from railui.io.number_format import scale_to_prefix, typeset_unit
from railui.io.problems import Findings
from railui.optimisation.knee import find_knee
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.optimisation.study_reader import read_constraints

AT_LIMIT: Final = 0.01  # of the range of a variable, or of the bound of a constraint, that counts as at the limit
SIGNIFICANT_DIGITS: Final = 4
SPAN_DIGITS: Final = 2  # digits of the differences along the front
MAX_DECIMALS: Final = 6
SHORT_COLUMNS: Final = 12  # of a line of a short heading


@dataclass(frozen=True, eq=False)
class FrontColumn:
    """Quantity of the designs on a front, in the unit that is shown.

    Attributes
    ----------
    kind : str
        objective, variable or constraint.
    name, symbol, group : str
        Name, its short form and what it belongs to.
    unit : str
        Typeset unit; empty for a pure number.
    values : FloatArray
        Value of each design.
    evaluated : FloatArray
        Value of each feasible design so far.
    baseline : float
        Value of the baseline; NaN if unknown.
    low, high : float or None
        Bounds of a variable or of a constraint.
    factor : float
        Shown value over SI value.
    """

    kind: str
    name: str
    symbol: str
    group: str
    unit: str
    values: FloatArray
    evaluated: FloatArray
    baseline: float
    low: float | None = None
    high: float | None = None
    factor: float = 1.0

    @property
    def limits_text(self) -> str:
        """Bounds as text."""
        if self.kind == "objective":
            return self.group
        if self.low is not None and self.high is not None:
            return f"{self.low:.4g} to {self.high:.4g}"
        return f">= {self.low:.4g}" if self.low is not None else f"<= {self.high:.4g}"

    def marks(self) -> str:
        """Return a character per design: ‹ at the lower limit, › at the upper one."""
        low, high = self.low, self.high
        span = high - low if low is not None and high is not None else abs(low if low is not None else high or 0.0)
        near = AT_LIMIT * (span or 1.0)
        return "".join(
            "‹" if low is not None and v <= low + near else "›" if high is not None and v >= high - near else " "
            for v in self.values
        )

    def cells(self) -> tuple[str, ...]:
        """Return the values as texts with equal decimals, so many that neighbours on the front differ."""
        finite = np.abs(self.values[np.isfinite(self.values)])
        largest, span = float(finite.max(initial=0.0)), float(np.ptp(finite)) if len(finite) else 0.0
        decimals = SIGNIFICANT_DIGITS - 1 - int(np.floor(np.log10(largest))) if largest > 0 else 0
        if span > 0:
            decimals = max(decimals, SPAN_DIGITS - int(np.floor(np.log10(span))))
        decimals = min(MAX_DECIMALS, max(0, decimals))
        return tuple(f"{v:.{decimals}f}" if np.isfinite(v) else "none" for v in self.values)

    def column(self) -> Column:
        """Return the column of a table."""
        limits = self.limits_text.replace(" to ", "...")
        if self.kind == "variable":
            short = self.symbol, self.unit or "-", limits
        else:
            first, _, rest = self.name.partition(" ")
            short = first[:SHORT_COLUMNS], rest[:SHORT_COLUMNS], f"{limits} {self.unit}".strip()
        heads = (self.group if self.kind == "variable" else self.kind, self.name, self.unit or "-", self.limits_text)
        return Column(heads, short, self.cells(), tuple(self.values.tolist()), self.marks())


def front_columns(history: SearchHistory) -> list[FrontColumn]:
    """Return objectives, variables and constraints of the designs on the front."""
    return [*_objectives(history), *_variables(history), *_constraints(history)]


def front_table(history: SearchHistory, columns: list[FrontColumn]) -> list[Column]:
    """Return the columns of the table: number of the design, marked at the knee, then every quantity."""
    best = knee_index(history)
    count = len(history.front()[1])
    numbers = tuple(f"{i}{' knee' if i == best else ''}" for i in range(count))
    first = Column(("", "design", "", ""), ("", "design", ""), numbers, tuple(float(i) for i in range(count)))
    return [first, *(column.column() for column in columns)]


def knee_index(history: SearchHistory) -> int | None:
    """Return the number of the design at the knee of the front, or None."""
    if history.result is not None:
        best: int | None = history.result["knee"]
        return best
    front = history.front()[1]
    return find_knee(front * history.objective_signs).index if len(front) > 1 else None


def _objectives(history: SearchHistory) -> list[FrontColumn]:
    front, evaluated = history.front()[1], history.feasible_objectives()
    baseline = history.baseline
    return [
        _scaled("objective", name, "", over, RESPONSE_KEYS[text.split()[-1]].unit, front[:, i], evaluated[:, i], b)
        for i, (name, (text, over), b) in enumerate(
            zip(history.objective_names, history.plan.objectives, baseline, strict=True)
        )
    ]


def _variables(history: SearchHistory) -> list[FrontColumn]:
    plan, x, evaluated = history.plan, history.front()[0], history.feasible_designs()
    columns = []
    for i, (path, bounds) in enumerate(plan.bounds.items()):
        *groups, name = path.split(".")
        group = "" if groups[-1] == "vehicle" else groups[-1]
        columns.append(
            _scaled(
                "variable",
                name.replace("_", " "),
                symbol_text(plan.design.parameter(path).symbol) or name[:SHORT_COLUMNS],
                group.replace("_", " "),
                plan.unit(path),
                x[:, i] if len(x) else np.zeros(0),
                evaluated[:, i] if len(evaluated) else np.zeros(0),
                plan.design.value(path),
                *bounds,
            )
        )
    return columns


def _constraints(history: SearchHistory) -> list[FrontColumn]:
    constraints = read_constraints(list(history.plan.constraints), Findings("the plan"))
    front, evaluated = history.front_constraints(), history.feasible_constraints()
    if front.shape[1] != len(constraints):
        return []
    columns = []
    for i, constraint in enumerate(constraints):
        bounds = (constraint.bound, None) if constraint.relation == ">=" else (None, constraint.bound)
        name, unit = constraint.key.replace("_", " "), RESPONSE_KEYS[constraint.key].unit
        values = (front[:, i], evaluated[:, i], history.baseline_constraints[i])
        columns.append(_scaled("constraint", name, "", "", unit, *values, *bounds))
    return columns


def _scaled(
    kind: str,
    name: str,
    symbol: str,
    group: str,
    unit: str,
    values: FloatArray,
    evaluated: FloatArray,
    baseline: float,
    low: float | None = None,
    high: float | None = None,
) -> FrontColumn:
    """Return a column whose numbers have the prefix of the largest value."""
    known = [abs(x) for x in (*values[np.isfinite(values)], baseline, high or 0.0) if np.isfinite(x)]
    largest = max(known, default=0.0)
    number, shown_unit = scale_to_prefix(largest, unit)
    factor = number / largest if largest else 1.0
    return FrontColumn(
        kind,
        name,
        symbol,
        group,
        typeset_unit(shown_unit),
        factor * values,
        factor * evaluated,
        factor * baseline,
        None if low is None else factor * low,
        None if high is None else factor * high,
        factor,
    )
