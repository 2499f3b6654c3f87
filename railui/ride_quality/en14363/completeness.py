"""Completeness of an evaluation by the rules of EN 14363: sections, mean radii, signals and quantities."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

from railui.ride_quality.en14363.quantities import VehicleData
from railui.ride_quality.en14363.recording import BODY_COLUMN, FRAME_COLUMN, Recording
from railui.ride_quality.en14363.zones import ZONES

BODY, FRAME = "lateral acceleration of the carbody", "lateral acceleration of the bogie frame"
NO_BOGIE: Final = (
    "the design has no bogie (a body with wheelsets `under` it that carries another body): 12 - m/5 unknown"
)


def missing_parts(zones: Sequence[dict[str, Any]], recordings: Sequence[Recording], vehicle: VehicleData) -> list[str]:
    """Return what is missing: sections, mean radii, signals, quantities."""
    return [*_missing_in_zones(zones), *_missing_signals(recordings, vehicle)]


def _missing_in_zones(zones: Sequence[dict[str, Any]]) -> Iterator[str]:
    for z in zones:
        if z["sections"] < z["required"]:
            yield f"zone {z['zone']}: {z['sections']} of {z['required']} sections"
    for z, zone in zip(zones, ZONES, strict=True):
        mean, (low, high) = z["mean_radius"], zone.mean_radius
        if mean is not None and not low <= mean <= high:
            yield f"zone {z['zone']}: mean radius {mean:.0f} m, not {low:g} to {high:g} m"
    yield from (f"zone {z['zone']}: no value" for z in zones if z["sections"] and not z["quantities"])


def _missing_signals(recordings: Sequence[Recording], vehicle: VehicleData) -> Iterator[str]:
    is_simplified = not any(piece.wheelsets for piece in recordings)
    if not any(piece.names(BODY_COLUMN) for piece in recordings):
        yield f"{BODY}: no signal"
    if is_simplified:
        if not any(piece.names(FRAME_COLUMN) for piece in recordings):
            yield f"{FRAME}: no signal"
        elif vehicle.bogie_mass is None:
            yield f"{FRAME}: {NO_BOGIE}"
        yield "guiding forces: the simplified method of accelerations was used"
    elif not any(name.startswith("Q") for piece in recordings for name in piece.series):
        yield "wheel loads Q: no Y/Q"
