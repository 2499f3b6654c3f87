"""What a check is, and all of them in their order."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from railui.doctor.check import Check


def doctor(reference: Path | None = None, jobs: int | None = None) -> dict[str, Any]:
    """Every published value that this installation can be held to, and the machine: checks, skipped, seconds, ok.

    `reference`: a directory with the data of others (en15302, profiles), without which what needs it is skipped.
    A check that cannot even be computed fails with what was said.
    """
    from railui.doctor import contact, machine, track_and_comfort, vehicles

    began = time.perf_counter()
    checks, skipped = [], []
    for group in (*vehicles.GROUPS, *contact.GROUPS, *track_and_comfort.GROUPS):
        checks += _tried(group)
    for name, by_data in contact.WITH_DATA.items():
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
