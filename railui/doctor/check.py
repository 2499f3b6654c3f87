"""A check: an expected and a computed value within a tolerance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Value = float | str | None | Sequence[float | None]


@dataclass(frozen=True)
class Check:
    """A value that is known, what came out here, the tolerance (absolute; None: the very same), and its source."""

    name: str
    expected: Value
    computed: Value
    source: str
    tolerance: float | None = None

    @property
    def is_ok(self) -> bool:
        """Is what came out what is known?"""
        if isinstance(self.expected, str) or isinstance(self.computed, str) or self.tolerance is None:
            return self.expected == self.computed
        known, found = np.atleast_1d(np.array(self.expected, float)), np.atleast_1d(np.array(self.computed, float))
        if known.shape != found.shape:
            return False
        same = (np.abs(known - found) <= self.tolerance) | (np.isnan(known) & np.isnan(found))
        return bool(np.all(same))

    def as_dict(self) -> dict[str, Any]:
        """The check as a row of the JSON."""
        return {
            "name": self.name,
            "expected": self.expected,
            "got": self.computed,
            "tolerance": self.tolerance,
            "ok": self.is_ok,
            "source": self.source,
        }
