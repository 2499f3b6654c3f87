"""Grouping of models that may share a SIMD batch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from railui.vehicle.model import Model


def group_by_structure(models: Sequence[Model]) -> Iterator[list[int]]:
    """Yield the indices of models that may share a kernel call, group by group."""
    groups: dict[tuple[Any, ...], list[int]] = {}
    for i, model in enumerate(models):
        groups.setdefault(_structure_key(model), []).append(i)
    yield from groups.values()


def _structure_key(model: Model) -> tuple[Any, ...]:
    """Return everything that vehicles of one kernel call have in common."""
    design = model.design
    words = (design.gauge_widens_clearance, design.setting("riding.guidance"))
    return (model.structure_key, design.riding, words)
