"""An effect as it stands in a vehicle: a law, its place, its numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

Number = float | tuple[float, ...]


@dataclass(frozen=True)
class PlacedEffect:
    """One effect: kind, place, wheelset (1, 2 or None for both), parameters in SI (lists for a curve).

    `against` says what a curve stands against: z, v or s. `defaulted` names what a file left out.
    """

    kind: str
    at: str
    wheelset: int | None = None
    parameters: Mapping[str, Number] = field(default_factory=dict)
    against: str | None = None
    defaulted: frozenset[str] = field(default=frozenset(), compare=False, repr=False)

    def __hash__(self) -> int:
        return hash((self.kind, self.at, self.wheelset, tuple(sorted(self.parameters.items())), self.against))

    def entry(self, *, given_only: bool = False) -> dict[str, Any]:
        """The keys and values as they stand in a file, SI.

        >>> PlacedEffect("free_play", "primary_lateral", 2, {"half_width": 3e-4}).entry()
        {'kind': 'free_play', 'at': 'primary_lateral', 'wheelset': 2, 'half_width': 0.0003}
        """
        keys: dict[str, Any] = {"kind": self.kind, "at": self.at}
        keys |= {k: v for k, v in (("wheelset", self.wheelset), ("against", self.against)) if v is not None}
        for key, value in self.parameters.items():
            if not (given_only and key in self.defaulted):
                keys[key] = list(value) if isinstance(value, tuple) else value
        return keys
