"""Rows for the kernel from varied parameters, and samples of estimated parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.vehicle.design_reader import Design
from railui.vehicle.effects import default_at
from railui.vehicle.model import Model
from railui.vehicle.profile_tables import with_common_tables

MIN_FRACTION = 0.01  # fraction of a positive number below which a deviation cannot reduce it


@dataclass(frozen=True, eq=False)
class ParameterisedModel:
    """Model with variable values at `paths`, and constant `deviations` [SI] of other numbers.

    Its rows equal those of `Design.with_values`: a number of an effect that the file left to its default follows the
    vehicle's.

    >>> from railui.vehicle.resolve import resolve_model
    >>> varied = ParameterisedModel(resolve_model("designs/test_bogie.yaml"), ("vehicle.primary.lateral_stiffness",))
    >>> varied.rows(np.array([[2e6], [5e6]]))[:, 10].tolist()
    [2000000.0, 5000000.0]
    """

    model: Model
    paths: tuple[str, ...]
    deviations: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        design = self.model.design
        if design.profiles is not None:
            # a number of one group of wheelsets that the design leaves to all of them becomes its own
            own = {path: design.value(path) for path in self.paths if path not in self.model.columns}
            design = with_common_tables(design.with_values(own) if own else design)
            object.__setattr__(self, "model", replace(self.model, design=design))

    def rows(self, x: FloatArray) -> FloatArray:
        """Return rows [n, row] of the vehicles with values x [n, path]."""
        if self._varies_profiles:
            return np.stack([self._followed_row(values) for values in np.atleast_2d(x)])
        rows = np.tile(self.model.row, (len(x), 1))
        rows[:, [self.model.columns[path] for path in self.paths]] = x
        for path, by in self.deviations.items():
            column = self.model.columns[path]
            rows[:, column] = _clip_to_range(self.model.design, path, rows[:, column], by)
        if self._following_numbers:
            for row in rows:
                values = self._values(row)
                for column, parameter, at in self._following_numbers:
                    value = default_at(parameter, at, values)
                    row[column] = row[column] if value is None else value
        return rows

    @cached_property
    def _following_numbers(self) -> list[tuple[int, Any, str]]:
        """Column, record and location of every effect's number that the file left to its default."""
        changed = {*self.paths, *self.deviations}
        numbers = []
        for i, effect in enumerate(self.model.design.effects):
            for parameter in core.effect_record(effect.kind)["parameters"]:
                path = f"effects.{i}.{parameter['key']}"
                if parameter["key"] in effect.defaulted and path not in changed:
                    numbers.append((self.model.columns[path], parameter, effect.at))
        return numbers

    @cached_property
    def _varies_profiles(self) -> bool:
        """True if contact parameters or tables follow the varied numbers."""
        profiles = self.model.design.profiles
        varied = {*self.paths, *self.deviations}
        return profiles is not None and profiles.is_followed and bool(varied & profiles.input_paths())

    def _followed_row(self, x: FloatArray) -> FloatArray:
        """Return the row [row] of the vehicle with values x [path]."""
        design = self.model.design.with_values(dict(zip(self.paths, map(float, x), strict=True)))
        deviations = {
            path: float(_clip_to_range(design, path, np.array([design.value(path)]), by)[0])
            for path, by in self.deviations.items()
        }
        design = design.with_values(deviations) if deviations else design
        return replace(self.model, design=with_common_tables(design)).row

    def _values(self, row: FloatArray) -> dict[str, float]:
        values = dict(self.model.design.values)
        for path in (*self.paths, *self.deviations):
            if path in values:
                values[path] = float(row[self.model.columns[path]])
        return values


def _clip_to_range(design: Design, path: str, values: FloatArray, by: float) -> FloatArray:
    """Return values plus a deviation, clipped to the range of a file."""
    parameter = design.parameter(path)
    lowest = np.full_like(values, parameter.minimum)
    if parameter.minimum >= 0 and (parameter.exclusive_minimum or by < 0):
        lowest = np.maximum(lowest, MIN_FRACTION * values)
    return np.clip(values + by, lowest, parameter.maximum)


def draw_deviations(design: Design, count: int, seed: Sequence[int]) -> list[dict[str, float]]:
    """Draw deviations of the estimated parameters: from the samples of a calibrated design, else from its covariance.

    Parameters
    ----------
    design : Design
    count : int
        Number of samples; 0 gives a single sample without deviations.
    seed : sequence of int
        Order of the design's samples; each one from a covariance has its own random numbers, keyed by `seed` and its
        index. The first ones of more are those of fewer.

    Raises
    ------
    ValueError
        If the design has fewer samples.

    Examples
    --------
    >>> from railui.vehicle.resolve import resolve_model
    >>> draw_deviations(resolve_model("designs/test_bogie.yaml").design, 0, [1])
    [{}]
    """
    if count == 0 or design.adjustment is None:
        return [{}]
    names, known = design.adjustment.names, design.adjustment.samples
    if known:
        if count > len(known):
            raise ValueError(f"{count} samples of a design that has {len(known)}")
        order = np.random.default_rng(np.random.SeedSequence(seed)).permutation(len(known))
        return [dict(zip(names, known[i], strict=True)) for i in order[:count]]
    root = covariance_root(np.array(design.adjustment.covariance, dtype=np.float64))
    samples = []
    for i in range(count):
        rng = np.random.default_rng(np.random.SeedSequence([*seed, i]))
        sample = root @ rng.standard_normal(len(names))
        samples.append(dict(zip(names, map(float, sample), strict=True)))
    return samples


def covariance_root(covariance: FloatArray) -> FloatArray:
    """Return a matrix R [n, n] with R R' = covariance [n, n].

    The eigenvalues are those of the correlation matrix: in SI, stiffnesses of 1e7 would drown conicities of 0.1.

    >>> root = covariance_root(np.array([[1e12, 4e3], [4e3, 2.5e-5]]))
    >>> bool(np.allclose(root @ root.T, [[1e12, 4e3], [4e3, 2.5e-5]], rtol=1e-12, atol=0))
    True
    """
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(sd > 0, sd, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
