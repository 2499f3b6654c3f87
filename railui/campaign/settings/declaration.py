"""Declaration of a setting: default, unit, meaning and provenance, kept in the metadata of a dataclass field."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

Number = TypeVar("Number", float, int)

BY_HAND = "chosen by hand"
KEY = "setting"


@dataclass(frozen=True)
class Setting:
    """A declared setting.

    `minimum` and `maximum` bound what a campaign may give, in `unit`; None: unbounded.
    """

    name: str
    group: str
    default: float | int
    unit: str
    meaning: str
    provenance: str
    minimum: float | None
    maximum: float | None

    @property
    def is_whole(self) -> bool:
        """True for a count."""
        return isinstance(self.default, int)


def setting(
    default: Number,
    *,
    meaning: str,
    unit: str = "1",
    provenance: str = BY_HAND,
    minimum: float | None = 0.0,
    maximum: float | None = None,
) -> Number:
    """Declare a setting as a field of a dataclass.

    Parameters
    ----------
    default
        A float in `unit`, or an int for a count.
    meaning
        One sentence that says what the number bounds.
    provenance
        "derived: ...", "trial: ...", "conventional: ..." with the source, or `BY_HAND`.
    """
    record = {
        "default": default,
        "unit": unit,
        "meaning": meaning,
        "provenance": provenance,
        "minimum": minimum,
        "maximum": maximum,
    }
    return dataclasses.field(default=default, metadata={KEY: record})


def declared(group: str, stage: type[Any]) -> Iterator[Setting]:
    """List the settings of one stage."""
    for f in dataclasses.fields(stage):
        yield Setting(name=f.name, group=group, **f.metadata[KEY])
