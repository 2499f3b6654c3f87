"""Corrections of the measured columns of a campaign, as its `sensors` mapping states them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from railui.io.units import UnitError, parse_unit_like
from railui.io.yaml_writer import number_text

TRACK_OFFSET = "track_offset"
EFFECTS = "effects"
DIGITS = 5  # of a printed estimate


@dataclass(frozen=True)
class Correction:
    """Known fault of one recorded column, which the reader of the campaign undoes.

    Attributes
    ----------
    gain
        Recorded value over true value; -1 for a sensor that is mounted the wrong way.
    unit
        Actual unit of the numbers, which replaces that of the header; None: unit of the header.
    delay
        Time [s] by which the record is late.
    clock_rate
        Rate of the logger's clock over that of the run's clock; both start together.
    swap_with
        Column with which the record was exchanged.
    gravity
        Acceleration [m/s^2] per radian of cross-level that the record contains.
    hum
        Frequency [Hz] of a line that the record contains.
    leave_out
        Whether the column is not used at all.
    runs
        Names of the runs concerned; empty: all runs.
    """

    channel: str
    gain: float = 1.0
    unit: str | None = None
    delay: float = 0.0
    clock_rate: float = 1.0
    swap_with: str | None = None
    gravity: float = 0.0
    hum: float = 0.0
    leave_out: bool = False
    runs: tuple[str, ...] = ()

    def entry(self) -> dict[str, Any]:
        """Return the keys of the campaign file that differ from their defaults."""
        keys: dict[str, Any] = {}
        for name in ("gain", "unit", "delay", "clock_rate", "swap_with", "gravity", "hum", "leave_out"):
            value = getattr(self, name)
            if value != getattr(Correction, name):
                keys[name] = value
        return keys | ({"runs": list(self.runs)} if self.runs else {})

    def concerns(self, run: str) -> bool:
        """True if a run has this fault."""
        return not self.runs or run in self.runs

    def joined(self, other: Correction) -> Correction:
        """Return both corrections of one channel as one; gains multiply, delays add."""
        merged = replace(
            self,
            gain=self.gain * other.gain,
            delay=self.delay + other.delay,
            clock_rate=self.clock_rate * other.clock_rate,
            gravity=self.gravity + other.gravity,
        )
        return replace(
            merged,
            unit=other.unit or self.unit,
            swap_with=other.swap_with or self.swap_with,
            hum=other.hum or self.hum,
            leave_out=self.leave_out or other.leave_out,
        )


@dataclass(frozen=True)
class Corrections:
    """All corrections of a campaign.

    Attributes
    ----------
    channels
        Corrections of single columns.
    track_offset
        Distance [m] by which the track columns are recorded too far along the line, by run; "" for every other run.
    """

    channels: tuple[Correction, ...] = ()
    track_offset: Mapping[str, float] = field(default_factory=dict, hash=False)

    def __bool__(self) -> bool:
        return bool(self.channels) or any(self.track_offset.values())

    def of_run(self, run: str) -> tuple[tuple[Correction, ...], float]:
        """Return the corrections of the columns of a run, and the offset of its track [m]."""
        offset = self.track_offset.get(run, self.track_offset.get("", 0.0))
        return tuple(c for c in self.channels if c.concerns(run)), offset

    def entry(self) -> dict[str, Any]:
        """Return the `sensors` mapping of the campaign file."""
        keys: dict[str, Any] = {}
        for correction in self.channels:
            keys.setdefault(correction.channel, []).append(correction.entry())
        rows: dict[str, Any] = {name: rows[0] if len(rows) == 1 else rows for name, rows in keys.items()}
        if self.track_offset:
            only = self.track_offset.get("") if set(self.track_offset) == {""} else None
            rows[TRACK_OFFSET] = dict(self.track_offset) if only is None else only
        return rows

    def joined(self, other: Corrections) -> Corrections:
        """Return these corrections followed by others; entries of one channel and the same runs become one."""
        channels = list(self.channels)
        for correction in other.channels:
            for i, known in enumerate(channels):
                if (known.channel, known.runs) == (correction.channel, correction.runs):
                    channels[i] = known.joined(correction)
                    break
            else:
                channels.append(correction)
        names = dict.fromkeys([*self.track_offset, *other.track_offset])
        offsets = {
            n: self.track_offset.get(n, self.track_offset.get("", 0.0))
            + other.track_offset.get(n, other.track_offset.get("", 0.0))
            for n in names
        }
        return Corrections(tuple(channels), offsets)


def yaml_line(corrections: Corrections) -> str:
    """Return the line of the campaign file that makes these corrections.

    >>> yaml_line(Corrections((Correction("rf", gain=-1.0),)))
    'sensors: {rf: {gain: -1}}'
    >>> yaml_line(Corrections((Correction("e1", delay=0.0802),), {"": 0.3}))
    'sensors: {e1: {delay: 80.2 ms}, track_offset: 0.3 m}'
    """
    return f"sensors: {_flow(corrections.entry())}"


QUANTITIES = {"delay": ("ms", 1e3), TRACK_OFFSET: ("m", 1.0), "gravity": ("m/s^2", 1.0), "hum": ("Hz", 1.0)}


def _flow(value: Any, key: str = "") -> str:
    """Return a value in YAML's flow style, numbers rounded."""
    if isinstance(value, Mapping):
        inner = key if key == TRACK_OFFSET else ""
        return "{" + ", ".join(f"{k}: {_flow(v, inner or k)}" for k, v in value.items()) + "}"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ", ".join(_flow(v, key) for v in value) + "]"
    if isinstance(value, float | int):
        unit, factor = QUANTITIES.get(key, ("", 1.0))
        digits = 8 if key == "clock_rate" else DIGITS
        return f"{number_text(float(f'{value * factor:.{digits}g}'))} {unit}".strip()
    return str(value)


def gain_of_unit(unit: str, header: str) -> float:
    """Return the gain of a column whose numbers are in a unit and whose header names another.

    `g` is the acceleration of gravity here, not the gram.

    >>> gain_of_unit("mm", "m"), round(gain_of_unit("g", "m/s^2"), 6)
    (1000.0, 0.101972)
    """
    return parse_unit_like(header, unit).factor / factor_of_unit(unit, header)


def factor_of_unit(unit: str, header: str) -> float:
    """Return the factor to SI of a unit; UnitError if it does not fit the header's."""
    given = parse_unit_like(unit, header)
    if not given.is_compatible(parse_unit_like(header, unit)):
        raise UnitError(f"the unit {unit} does not fit", f"give a unit like {header}")
    return given.factor
