"""Contact parameters of the measured profiles, to stand beside those that the motions determine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from railui.io.problems import FileProblems
from railui.vehicle.contact_profiles import ContactProfiles

LEAST, MOST = 2.5e-4, 1e-2  # m: standard deviations that profiles can be linearised over


def of_profiles(
    profiles: ContactProfiles | None, paths: Iterable[str], measured: Mapping[str, float | None]
) -> dict[str, Any] | None:
    """What the profiles of a design give at the contact paths, linearised over the measured motion; None without any.

    wheel, rail: files; deviation [m] of e1 and e2, measured or else as the design says; parameters by path, SI, null
    where the pair has none; note: why there is nothing. Source: thesis 5.5.
    """
    if profiles is None:
        return None
    from railui.contact.profile import ProfileFault

    deviation = [_within(measured.get(f"sd_{e}") or profiles.given["sd"]) for e in ("e1", "e2")]
    told: dict[str, Any] = {"wheel": profiles.wheel.name, "rail": profiles.rail.name, "deviation": deviation,
                            "surface": profiles.given["surface"], "parameters": {}, "note": ""}  # fmt: skip
    try:
        numbers = [profiles.numbers(sd)[0] for sd in deviation]
    except (OSError, FileProblems, ProfileFault) as fault:
        return told | {"note": str(fault)}
    for path in paths:
        if path.startswith("contact."):
            told["parameters"][path] = numbers["trailing" in path].get(path.rpartition(".")[2])
    return told


def _within(deviation: float) -> float:
    return min(max(deviation, LEAST), MOST)
