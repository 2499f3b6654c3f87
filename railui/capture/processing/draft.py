"""A map to begin with: every channel of a recording under the quantity that its name and unit suggest."""

from __future__ import annotations

from railui.capture.processing.map_model import TARGETS
from railui.capture.processing.recording import Recording
from railui.io.units import UnitError, convert
from railui.io.yaml_writer import scalar_text


def draft_map(recording: Recording) -> str:
    """The text of map.yaml; what fits no quantity by name stands in comments with what its unit allows."""
    lines = [
        "schema: railui.map/1",
        f"name: {scalar_text(recording.name)}",
        "convention: railui        # what is positive: or EN 13848, SIMPACK, ISO 8855, ...: docs/capture.md",
        "# vehicle: design.yaml    # its wheelbase, gauge, radius and roll: needed to reconstruct the rail position",
    ]
    speed = next((name for name in recording.channels if name.lower() in ("v", "speed", "velocity")), None)
    lines.append(f"speed: {{channel: {scalar_text(speed)}}}" if speed else "# speed: {channel: NAME}")
    known = [name for name in recording.channels if name in TARGETS]
    lines.append("sensors:")
    for name in known:
        lines.append(f"  {name}: {{channel: {scalar_text(name)}{_unit(recording, name)}}}")
    for name in recording.channels:
        if name in known or name == speed or name == recording.against:
            continue
        may = [target for target in TARGETS if _fits(recording.units.get(name), target)]
        told = f"one of {', '.join(may)}" if may else "no quantity of this unit is known"
        lines.append(f"  # NAME: {{channel: {scalar_text(name)}{_unit(recording, name)}}}    # {told}")
    return "\n".join(lines) + "\n"


def _unit(recording: Recording, name: str) -> str:
    return "" if recording.units.get(name) else ", unit: ?"


def _fits(unit: str | None, target: str) -> bool:
    wanted = TARGETS[target].unit
    if unit is None:
        return True
    if unit in ("g", "gn"):
        return wanted == "m/s^2"
    try:
        convert(1.0, unit, wanted)
    except UnitError:
        return False
    return bool(wanted)
