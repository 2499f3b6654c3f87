"""Contact parameters of the measured profiles, for comparison with the calibrated ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from railui.io.problems import FileProblems
from railui.vehicle.design import Design

MIN_DEVIATION, MAX_DEVIATION = 2.5e-4, 1e-2  # m, of the linearisation


def profile_parameters(
    design: Design, paths: Iterable[str], measured: Mapping[str, float | None]
) -> dict[str, Any] | None:
    """Return the contact parameters of the profiles, linearised over the measured motion; None without profiles.

    Keys: wheel, rail (files), deviation [m] of e1 and e2 (measured, else that of the design), surface, parameters by
    path (SI, None where the pair has none), note (why there are none). Source: thesis 5.5.
    """
    profiles = design.profiles
    if profiles is None:
        return None
    from railui.contact.profile import ProfileError

    inputs = profiles.inputs(design.values)
    first, last = (inputs.get(group, next(iter(inputs.values()))) for group in ("leading", "trailing"))
    deviation = [_clip(measured.get(f"sd_{e}") or one.sd) for e, one in (("e1", first), ("e2", last))]
    result: dict[str, Any] = {
        "wheel": profiles.wheel.name,
        "rail": profiles.rail.name,
        "deviation": deviation,
        "surface": first.surface,
        "parameters": {},
        "note": "",
    }
    try:
        each = zip((first, last), deviation, strict=True)
        leading, trailing = [replace(one, sd=sd).contact_parameters()[0] for one, sd in each]
    except (OSError, FileProblems, ProfileError) as error:
        return result | {"note": str(error)}
    for path in paths:
        if path.startswith("contact."):
            values = trailing if "trailing" in path else leading
            result["parameters"][path] = values.get(path.rpartition(".")[2])
    return result


def _clip(deviation: float) -> float:
    return min(max(deviation, MIN_DEVIATION), MAX_DEVIATION)
