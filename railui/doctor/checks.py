"""What a check is, and all of them in their order."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

Value = float | str | None | Sequence[float | None]


@dataclass(frozen=True)
class Check:
    """A value that is known, what came out here, the tolerance (absolute; None: the very same), and its source."""

    name: str
    expected: Value
    got: Value
    source: str
    tolerance: float | None = None

    @property
    def ok(self) -> bool:
        """Is what came out what is known?"""
        if isinstance(self.expected, str) or isinstance(self.got, str) or self.tolerance is None:
            return self.expected == self.got
        known, found = np.atleast_1d(np.array(self.expected, float)), np.atleast_1d(np.array(self.got, float))
        if known.shape != found.shape:
            return False
        same = (np.abs(known - found) <= self.tolerance) | (np.isnan(known) & np.isnan(found))
        return bool(np.all(same))

    def as_dict(self) -> dict[str, Any]:
        """The check as a row of the JSON."""
        return {
            "name": self.name,
            "expected": self.expected,
            "got": self.got,
            "tolerance": self.tolerance,
            "ok": self.ok,
            "source": self.source,
        }


def doctor(reference: Path | None = None, jobs: int | None = None) -> dict[str, Any]:
    """Every published value that this installation can be held to, and the machine: checks, skipped, seconds, ok.

    `reference`: a directory with the data of others (en15302, profiles), without which what needs it is skipped.
    A check that cannot even be computed fails with what was said.
    """
    from railui.doctor import contacts, lines, machine, vehicles

    began = time.perf_counter()
    checks, skipped = [], []
    for group in (*vehicles.GROUPS, *contacts.GROUPS, *lines.GROUPS):
        checks += _tried(group)
    for name, by_data in contacts.WITH_DATA.items():
        if reference is not None:
            checks += _tried(lambda by_data=by_data: by_data(reference))  # type: ignore[misc]
        else:
            skipped.append({"name": name, "reason": "its data are not ours to ship: give --reference DIR"})
    checks += [check for group in machine.GROUPS for check in _tried(lambda group=group: group(jobs))]  # type: ignore[misc]
    return {
        "ok": all(check.ok for check in checks),
        "checks": [check.as_dict() for check in checks],
        "skipped": skipped,
        "machine": machine.told(jobs),
        "seconds": time.perf_counter() - began,
    }


def _tried(group: Callable[[], Iterator[Check]]) -> list[Check]:
    found: list[Check] = []
    try:
        for check in group():
            found.append(check)
    except Exception as error:  # whatever it is, it is what the doctor has to tell
        name = getattr(group, "__name__", "check").replace("_", " ")
        found.append(Check(name, "computed", f"{type(error).__name__}: {error}", "this installation"))
    return found
