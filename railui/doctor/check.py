"""A check: an expected and a computed value within a tolerance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Value = float | str | None | Sequence[float | None]


@dataclass(frozen=True)
class Check:
    """Expected and computed value with an absolute tolerance (None: equality) and the source of the expected value."""

    name: str
    expected: Value
    computed: Value
    source: str
    tolerance: float | None = None

    @property
    def is_ok(self) -> bool:
        """True if the computed value agrees with the expected one."""
        if isinstance(self.expected, str) or isinstance(self.computed, str) or self.tolerance is None:
            return self.expected == self.computed
        expected, computed = (
            np.atleast_1d(np.array(self.expected, float)),
            np.atleast_1d(np.array(self.computed, float)),
        )
        if expected.shape != computed.shape:
            return False
        same = (np.abs(expected - computed) <= self.tolerance) | (np.isnan(expected) & np.isnan(computed))
        return bool(np.all(same))

    def as_dict(self) -> dict[str, Any]:
        """Return the check as a row of the JSON result."""
        return {
            "name": self.name,
            "expected": self.expected,
            "got": self.computed,
            "tolerance": self.tolerance,
            "ok": self.is_ok,
            "source": self.source,
        }
