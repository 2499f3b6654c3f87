"""Draft of a sensor map: every channel of a recording under the quantity that its name and unit suggest."""

from __future__ import annotations

from railui.capture.processing.map_schema import QUANTITIES
from railui.capture.processing.recording import Recording
from railui.io.schema_line import schema_name
from railui.io.units import UnitError, convert
from railui.io.yaml_writer import YamlWriter, scalar_text

SPEED_NAMES = ("v", "speed", "velocity")


def draft_map(recording: Recording) -> str:
    """Return the text of map.yaml; channels without a matching name become comments with possible quantities."""
    writer = YamlWriter()
    writer.line(f"schema: {schema_name('map')}")
    writer.entry("name", recording.name)
    writer.entry("convention", "railui", "sign convention, or EN 13848, SIMPACK, ISO 8855, ...: docs/capture.md")
    writer.comment("vehicle: design.yaml    # its wheelbase, gauge, radius and roll: needed for the rail position")
    speed = next((name for name in recording.channels if name.lower() in SPEED_NAMES), None)
    if speed:
        writer.entry("speed", {"channel": speed})
    else:
        writer.comment("speed: {channel: NAME}")
    with writer.block("sensors"):
        for name in recording.channels:
            if name in QUANTITIES:
                writer.line(f"{name}: {_sensor_text(recording, name)}")
        for name in recording.channels:
            if name not in (*QUANTITIES, speed, recording.abscissa, recording.clock):
                writer.comment(f"NAME: {_sensor_text(recording, name)}    # {_suggestion(recording, name)}")
    if any(_is_acceleration(recording, name) for name in recording.channels):
        writer.comment(
            "gravity: raw if the accelerometer measures y'' - g phi (g phi is added), removed if it gives y''"
        )
    return writer.text()


def _sensor_text(recording: Recording, name: str) -> str:
    """Return the flow mapping of a sensor, with a placeholder for an unknown unit."""
    unit = "" if recording.units.get(name) else ", unit: ?"
    gravity = ", gravity: raw" if _is_acceleration(recording, name) else ""
    return f"{{channel: {scalar_text(name)}{unit}{gravity}}}"


def _is_acceleration(recording: Recording, name: str) -> bool:
    """Return True for a channel with a unit that only an acceleration has."""
    return recording.units.get(name) is not None and _unit_fits(recording.units[name], "ayf")


def _suggestion(recording: Recording, name: str) -> str:
    """Return the quantities that the unit of a channel allows."""
    possible = [quantity for quantity in QUANTITIES if _unit_fits(recording.units.get(name), quantity)]
    return f"one of {', '.join(possible)}" if possible else "no quantity has this unit"


def _unit_fits(unit: str | None, quantity: str) -> bool:
    wanted = QUANTITIES[quantity].unit
    if unit is None:
        return True
    if unit in ("g", "gn"):
        return wanted == "m/s^2"
    try:
        convert(1.0, unit, wanted)
    except UnitError:
        return False
    return bool(wanted)
