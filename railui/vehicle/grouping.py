"""Grouping of models that may share a SIMD batch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from railui.vehicle.model import Model


def by_structure(models: Sequence[Model]) -> Iterator[list[int]]:
    """The indices of models that may share the lanes of one kernel call, group by group."""
    found: dict[tuple[Any, ...], list[int]] = {}
    for i, model in enumerate(models):
        found.setdefault(_structure(model), []).append(i)
    yield from found.values()


def _structure(model: Model) -> tuple[Any, ...]:
    """What vehicles must share to ride in the lanes of one kernel call."""
    design = model.design
    words = (design.gauge_widens_clearance, design.setting("riding.guidance"))
    return (model.form, design.riding, words)
