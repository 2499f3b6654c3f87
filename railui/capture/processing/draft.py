"""Draft of a sensor map: every channel of a recording under the quantity that its name and unit suggest."""

from __future__ import annotations

from railui.capture.processing.map_schema import QUANTITIES, TRACK_QUANTITIES
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
    is_track = recording.abscissa == "s"
    if not is_track:
        writer.comment("vehicle: design.yaml    # its wheelbase, gauge, radius and roll: needed for the rail position")
    speed = next((name for name in recording.channels if name.lower() in SPEED_NAMES), None)
    if speed:
        writer.entry("speed", {"channel": speed})
    elif not is_track:
        measured = [name for name in recording.channels if _is_speed(recording.units.get(name))]
        writer.comment(f"speed: {{channel: {scalar_text(measured[0]) if measured else 'NAME'}}}")
    with writer.block("sensors"):
        for name in recording.channels:
            if name in QUANTITIES:
                writer.line(f"{name}: {_sensor_text(recording, name)}")
        for name in recording.channels:
            if name not in (*QUANTITIES, speed, recording.abscissa, recording.clock):
                writer.comment(_commented_sensor(recording, name))
    if any(_is_acceleration(recording, name) for name in recording.channels):
        writer.comment(
            "gravity: raw if the accelerometer measures y'' - g phi (g phi is added), removed if it gives y''"
        )
    return writer.text()


def _commented_sensor(recording: Recording, name: str) -> str:
    """Return the comment for a channel of an unknown name: a sensor to complete, or the reason why it is none."""
    unit = recording.units.get(name)
    quantities = TRACK_QUANTITIES if recording.abscissa == "s" else tuple(QUANTITIES)
    possible = [quantity for quantity in quantities if _unit_fits(unit, quantity)]
    if possible:
        return f"NAME: {_sensor_text(recording, name)}    # one of {', '.join(possible)}"
    if _is_speed(unit):
        return f"{scalar_text(name)} [{unit}]: a speed, see above"
    sensor = f"NAME: {{channel: {scalar_text(name)}, unit: UNIT}}"
    return f"{scalar_text(name)} [{unit}]: no quantity has this unit; where it is misspelt, `{sensor}`"


def _sensor_text(recording: Recording, name: str) -> str:
    """Return the flow mapping of a sensor, with a placeholder for an unknown unit."""
    unit = "" if recording.units.get(name) else ", unit: ?"
    gravity = ", gravity: raw" if _is_acceleration(recording, name) else ""
    return f"{{channel: {scalar_text(name)}{unit}{gravity}}}"


def _is_acceleration(recording: Recording, name: str) -> bool:
    """Return True for a channel with a unit that only an acceleration has."""
    return recording.units.get(name) is not None and _unit_fits(recording.units[name], "ayf")


def _unit_fits(unit: str | None, quantity: str) -> bool:
    wanted = QUANTITIES[quantity].unit
    if unit is None:
        return True
    return bool(wanted) and _has_dimension(unit, wanted)


def _is_speed(unit: str | None) -> bool:
    return unit is not None and _has_dimension(unit, "m/s")


def _has_dimension(unit: str, wanted: str) -> bool:
    try:
        convert(1.0, unit, wanted)
    except UnitError:
        return False
    return True
