"""Installation self-test: all checks in their order."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from railui.doctor.check import Check


def doctor(reference: Path | None = None, jobs: int | None = None) -> dict[str, Any]:
    """Compare published values with those that this installation computes, and check the machine.

    Parameters
    ----------
    reference : Path, optional
        Directory with data of third parties (en15302, profiles); checks that need them are skipped without it.
    jobs : int, optional
        Threads; by default all.

    Returns
    -------
    dict
        ok, checks, skipped, machine, seconds. A check that raises an exception fails with its message.
    """
    from railui.doctor import contact, machine, track_and_comfort, vehicles

    start = time.perf_counter()
    checks: list[Check] = []
    skipped = []
    for group in (*vehicles.GROUPS, *contact.GROUPS, *track_and_comfort.GROUPS):
        checks += _run(group)
    for name, data_check in contact.REFERENCE_DATA_CHECKS.items():
        if reference is not None:
            checks += _run(partial(data_check, reference), data_check.__name__)
        else:
            skipped.append({"name": name, "reason": "its data are not ours to ship: give --reference DIR"})
    for machine_check in machine.GROUPS:
        checks += _run(partial(machine_check, jobs), machine_check.__name__)
    return {
        "ok": all(check.is_ok for check in checks),
        "checks": [check.as_dict() for check in checks],
        "skipped": skipped + machine.skipped_checks(),
        "machine": machine.describe_machine(jobs),
        "seconds": time.perf_counter() - start,
    }


def _run(group: Callable[[], Iterator[Check]], name: str = "") -> list[Check]:
    """Return the checks of a group; an exception is a failed check."""
    checks: list[Check] = []
    try:
        for check in group():
            checks.append(check)
    except Exception as error:  # any error is a result of the self-test
        failed = (name or getattr(group, "__name__", "check")).replace("_", " ")
        checks.append(Check(failed, "computed", f"{type(error).__name__}: {error}", "this installation"))
    return checks
