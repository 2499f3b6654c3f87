"""Advice of the report: where to inspect the vehicle, the sensors or the data, by effect and verdict."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from railui import core
from railui.campaign.settings.detection import SelectionSettings
from railui.report.loop.noise import known_noise_text
from railui.report.loop.wording import joint_phrases, location_phrase
from railui.vehicle.multibody import Structure

Report = Mapping[str, Any]

NONE = "nothing on the vehicle; effects below the minimum detectable sizes remain possible"
UNLOCATED = "no location is supported by the data; check synchronisation and mounting, then repeat with more sensors"
OTHER_SPEED = "a run at another speed or amplitude, with a sensor at this location, separates causes"

# conditions that change a parameter, by what it varies with
VARIATIONS = {
    "run": "between the runs: load, weather, wear",
    "t": "during a run: temperature, wear, loss of fluid or pressure",
    "s": "along the track: rail profile, lubrication, gauge, track stiffness",
}
MORE_SIGNALS = "further signals next to these joints separate them"


def inspection_lines(report: Report, structure: Structure | None = None) -> list[str]:
    """Return what to inspect, the most likely first."""
    lines = [_effect_line(effect, structure) for effect in report["effects"]]
    if outside := report["outside"]:
        lines.append(_discrepancy_line(outside, structure))
    elif report["verdict"] in ("outside", "partial"):
        lines.append(UNLOCATED if not lines else OTHER_SPEED)
    if report["verdict"] == "none":
        ratio = report["unexplained"]
        if ratio is not None and ratio > SelectionSettings().unexplained_ratio:
            known = known_noise_text(report["floor"]["source"])
            lines.append(f"sensors and cables: noise is larger than {known}; {NONE}")
        else:
            lines.append(NONE)
    return list(dict.fromkeys(lines))


def _effect_line(effect: Mapping[str, Any], structure: Structure | None) -> str:
    at = effect["at"]
    is_rig = at == "rig"
    place = "the component" if is_rig else location_phrase(at, effect["wheelset"], structure).removeprefix("signal ")
    return str(core.effect_record(effect["kind"])["inspection"]).format(place=place)


def _discrepancy_line(outside: Mapping[str, Any], structure: Structure | None) -> str:
    if outside.get("parameter"):
        return f"conditions that change {outside['parameter']} {VARIATIONS[_abscissa(outside)]}"
    if not outside["at"]:
        joints = joint_phrases((o["at"] for o in outside.get("locations", ())), structure)
        return f"{' and '.join(joints)}; {MORE_SIGNALS}" if joints else UNLOCATED
    if outside["at"] == "rig":
        return "the component: an effect that is in no law of the catalogue; compare with its force curve below"
    return f"{location_phrase(outside['at'], outside['wheelset'], structure)}; {OTHER_SPEED}"


def _abscissa(outside: Mapping[str, Any]) -> str:
    """Return what a parameter varies with: run, time or distance."""
    if outside.get("runs") is not None:
        return "run"
    return "t" if outside["against"] == "t" else "s"
