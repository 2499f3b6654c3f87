"""Effects of the final model that are in the catalogue: those that were added, and those of the nominal model."""

from __future__ import annotations

from collections.abc import Iterator

from railui import core
from railui.identification.result import LoopResult
from railui.vehicle.effects import PlacedEffect


def catalogued_effects(result: LoopResult, *, of_nominal: bool = False) -> Iterator[tuple[str, int, PlacedEffect]]:
    """Yield the group of the paths (effects or sensors), the index in it, and every effect that was added.

    of_nominal: those that the nominal model has already, instead. Force curves are left out.
    """
    final, nominal = result.after.model, result.nominal
    groups = (
        ("effects", final.design.effects, len(nominal.design.effects)),
        ("sensors", final.sensors, len(nominal.sensors)),
    )
    for group, effects, known in groups:
        for i, effect in enumerate(effects):
            if effect.kind not in core.CURVE_KINDS and (i < known) == of_nominal:
                yield group, i, effect
