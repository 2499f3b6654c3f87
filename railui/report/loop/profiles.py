"""Contact parameters of the measured profiles, for comparison with the calibrated ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from railui.io.problems import FileProblems
from railui.vehicle.contact_profiles import ContactProfiles

MIN_DEVIATION, MAX_DEVIATION = 2.5e-4, 1e-2  # m, of the linearisation


def profile_parameters(
    profiles: ContactProfiles | None, paths: Iterable[str], measured: Mapping[str, float | None]
) -> dict[str, Any] | None:
    """Return the contact parameters of the profiles, linearised over the measured motion; None without profiles.

    Keys: wheel, rail (files), deviation [m] of e1 and e2 (measured, else that of the design), surface, parameters by
    path (SI, None where the pair has none), note (why there are none). Source: thesis 5.5.
    """
    if profiles is None:
        return None
    from railui.contact.profile import ProfileError

    deviation = [_clip(measured.get(f"sd_{e}") or profiles.settings["sd"]) for e in ("e1", "e2")]
    result: dict[str, Any] = {
        "wheel": profiles.wheel.name,
        "rail": profiles.rail.name,
        "deviation": deviation,
        "surface": profiles.settings["surface"],
        "parameters": {},
        "note": "",
    }
    try:
        leading, trailing = [profiles.contact_parameters(sd)[0] for sd in deviation]
    except (OSError, FileProblems, ProfileError) as error:
        return result | {"note": str(error)}
    for path in paths:
        if path.startswith("contact."):
            values = trailing if "trailing" in path else leading
            result["parameters"][path] = values.get(path.rpartition(".")[2])
    return result


def _clip(deviation: float) -> float:
    return min(max(deviation, MIN_DEVIATION), MAX_DEVIATION)
