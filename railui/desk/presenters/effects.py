"""The catalogue of effects as a list to choose from."""

from __future__ import annotations

from railui.vehicle.design_reader import Design
from railui.vehicle.effect_records import is_curve, kernel_catalogue
from railui.vehicle.effects import PlacedEffect


def choices(design: Design) -> list[tuple[str, str]]:
    """Every kind at every place where it can stand in this design: key, line to show."""
    found = []
    for record in kernel_catalogue():
        if is_curve(record) or record["acts"] == "sensor":  # what was measured is no choice
            continue
        for at in record["at"]:
            if (at == "rig") == (design.kind == "rig"):
                told = f"{record['kind'].replace('_', ' '):22} {at.replace('_', ' '):18} {record['title']}"
                found.append((f"{record['kind']} {at}", told))
    return found


def placed(key: str) -> PlacedEffect:
    """The effect of a choice, its parameters at their defaults."""
    kind, at = key.split()
    return PlacedEffect(kind, at)
