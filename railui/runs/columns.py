"""Columns of a run: name, unit, role."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class Column:
    """Known column of a run; its role is clock, track, response or coach (forces of the carbody)."""

    name: str
    unit: str
    role: str
    caption: str


def _by_name(*columns: Column) -> dict[str, Column]:
    return {c.name: c for c in columns}


COLUMNS = _by_name(
    Column("t", "s", "clock", "time"),
    Column("s", "m", "clock", "distance of the leading wheelset"),
    Column("v", "m/s", "clock", "speed"),
    Column("yw", "m", "track", "lateral deviation of the track"),
    Column("phiw", "rad", "track", "cross-level of the track"),
    Column("gauge", "m", "track", "gauge deviation"),
    Column("e1", "m", "response", "leading wheelset relative to the rails"),
    Column("e2", "m", "response", "trailing wheelset relative to the rails"),
    Column("ay1", "m/s^2", "response", "acceleration of the leading axle boxes"),
    Column("ay2", "m/s^2", "response", "acceleration of the trailing axle boxes"),
    Column("ayf", "m/s^2", "response", "acceleration of the frame centre"),
    Column("rf", "rad/s", "response", "yaw rate of the frame"),
    Column("d1", "m", "response", "deflection of the leading primary suspension"),
    Column("d2", "m", "response", "deflection of the trailing primary suspension"),
    Column("psi1", "rad", "response", "yaw of the leading wheelset"),
    Column("psi2", "rad", "response", "yaw of the trailing wheelset"),
    Column("Qy", "N", "coach", "force of the carbody on the frame"),
    Column("Qpsi", "N*m", "coach", "moment of the carbody on the frame"),
)
# a one-mass rig: any unit except that of time
RIG_COLUMNS = _by_name(
    Column("t", "s", "clock", "time"),
    Column("u", "", "track", "input"),
    Column("z", "", "response", "motion of the mass"),
    Column("vz", "", "response", "speed of the mass"),
    Column("az", "", "response", "acceleration of the mass"),
)
# a component on a bench, whose motion is prescribed: any unit, too
BENCH_COLUMNS = _by_name(
    Column("t", "s", "clock", "time"),
    Column("z", "", "track", "prescribed motion"),
    Column("vz", "", "track", "speed of the prescribed motion"),
    Column("F", "", "response", "force of the component"),
)
FORMS = {"bogie": COLUMNS, "rig": RIG_COLUMNS, "bench": BENCH_COLUMNS}
RIG_FORMS = ("rig", "bench")
TRACK_COLUMNS = tuple(c for c in COLUMNS.values() if c.role in ("clock", "track"))
# usual sensors of a bogie, over which the NRMSE is averaged
COMPARED_CHANNELS = ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2")


@dataclass(frozen=True)
class VehicleColumns:
    """Columns of the runs of a multibody vehicle: clock, track, and the responses that its sensors may measure."""

    responses: tuple[Column, ...]

    @cached_property
    def columns(self) -> Mapping[str, Column]:
        """Columns by name."""
        return _by_name(*TRACK_COLUMNS, *self.responses)

    def __str__(self) -> str:
        return "vehicle"


Form = str | VehicleColumns  # "bogie", "rig", "bench", or the columns of a multibody vehicle


def columns_of(form: Form) -> Mapping[str, Column]:
    """Return the columns of the runs of a "bogie", a "rig", a "bench" with prescribed motion, or another vehicle."""
    return form.columns if isinstance(form, VehicleColumns) else FORMS.get(form, COLUMNS)


def is_compared(channel: str) -> bool:
    """True for a response that counts in the error: all but the yaw of a wheelset, which is seldom measured.

    >>> is_compared("ay3"), is_compared("psi2")
    (True, False)
    """
    return not re.fullmatch(r"psi\d+", channel)


def column_names(form: Form, *parts: str) -> tuple[str, ...]:
    """Return the names of the columns with certain roles.

    >>> column_names("bogie", "track")
    ('yw', 'phiw', 'gauge')
    """
    return tuple(c.name for c in columns_of(form).values() if c.role in parts)
