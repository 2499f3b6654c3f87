"""A design whose numbers vary: rows for the kernel from values at paths, without a design per evaluation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.vehicle.design_reader import Design
from railui.vehicle.effect_records import default_at
from railui.vehicle.model import Model

LEAST = 0.01  # share of a number below which a deviation does not bring it, where 0 cannot be


@dataclass(frozen=True, eq=False)
class ParameterisedModel:
    """A model with values [n, path] at `paths`, and `deviations` (SI) added to whatever stands at a path.

    Its rows are those of `Design.with_values`: an effect's number that was left to its default follows the
    vehicle's.

    >>> from railui.ride_quality.evaluation import model_of
    >>> varied = Varied(model_of("designs/test_bogie.yaml"), ("vehicle.primary.lateral_stiffness",))
    >>> varied.rows(np.array([[2e6], [5e6]]))[:, 10].tolist()
    [2000000.0, 5000000.0]
    """

    model: Model
    paths: tuple[str, ...]
    deviations: Mapping[str, float] = field(default_factory=dict)

    def rows(self, x: FloatArray) -> FloatArray:
        """Rows [n, row] of the vehicles with values x [n, path]."""
        rows = np.tile(self.model.row, (len(x), 1))
        rows[:, [self.model.columns[path] for path in self.paths]] = x
        for path, by in self.deviations.items():
            column = self.model.columns[path]
            rows[:, column] = _inside(self.model.design, path, rows[:, column], by)
        if self._following:
            for row in rows:
                values = self._values(row)
                for column, parameter, at in self._following:
                    value = default_at(parameter, at, values)
                    row[column] = row[column] if value is None else value
        return rows

    @cached_property
    def _following(self) -> list[tuple[int, Any, str]]:
        """Columns of effects' numbers that the file left to their defaults: with record and place."""
        changed = {*self.paths, *self.deviations}
        found = []
        for i, effect in enumerate(self.model.design.effects):
            for parameter in core.record(effect.kind)["parameters"]:
                path = f"effects.{i}.{parameter['key']}"
                if parameter["key"] in effect.defaulted and path not in changed:
                    found.append((self.model.columns[path], parameter, effect.at))
        return found

    def _values(self, row: FloatArray) -> dict[str, float]:
        values = dict(self.model.design.values)
        for path in (*self.paths, *self.deviations):
            if path in values:
                values[path] = float(row[self.model.columns[path]])
        return values


def _inside(design: Design, path: str, values: FloatArray, by: float) -> FloatArray:
    """Values plus a deviation, inside the range that a file may say."""
    parameter = design.parameter(path)
    lowest = np.full_like(values, parameter.minimum)
    if parameter.minimum >= 0 and (parameter.above or by < 0):
        lowest = np.maximum(lowest, LEAST * values)
    return np.clip(values + by, lowest, parameter.maximum)


def draws(design: Design, count: int, seed: Sequence[int]) -> list[dict[str, float]]:
    """Deviations of the adjusted parameters, `count` samples of their covariance; none: one without any.

    Each sample has its own random numbers, keyed by `seed` and its index.

    >>> from railui.ride_quality.evaluation import model_of
    >>> draws(model_of("designs/test_bogie.yaml").design, 0, [1])
    [{}]
    """
    if count == 0 or design.adjustment is None:
        return [{}]
    names, covariance = design.adjustment.names, np.array(design.adjustment.covariance)
    found = []
    for i in range(count):
        rng = np.random.default_rng(np.random.SeedSequence([*seed, i]))
        sample = rng.multivariate_normal(np.zeros(len(names)), covariance, method="eigh")
        found.append(dict(zip(names, map(float, sample), strict=True)))
    return found
