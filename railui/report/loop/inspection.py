"""Advice of the report: where to inspect the vehicle, the sensors or the data, by effect and verdict."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from railui import core
from railui.campaign.settings.detection import SelectionSettings
from railui.report.loop.noise import known_noise_text
from railui.report.loop.wording import location_phrase
from railui.vehicle.multibody import Structure

Report = Mapping[str, Any]

BY_KIND = {
    "spring": "stiffness of {place}: wrong spring, broken leaf or rubber, ice, data sheet",
    "viscous_damper": "dampers of {place}: type, leakage, temperature",
    "free_play": "clearance in {place}: guides, bushes, wear plates, pins",
    "cubic_stiffness": "progressive springs or rubber of {place}; force against deflection on a test bench",
    "quadratic_stiffness": "unequal springs or a preload at {place}: travel to either side",
    "bump_stop": "stops of {place}: gap and witness marks",
    "dry_friction": "sliding surfaces of {place}: wear, lubrication, friction dampers",
    "hysteresis": "rubber, leaf springs or friction dampers of {place}: force against deflection on a test bench",
    "quadratic_damper": "dampers of {place}: valve characteristic on a test bench",
    "asymmetric_damper": "dampers of {place}: compression and extension on a test bench",
    "maxwell_damper": "mountings and bushes of the dampers of {place}",
    "flange_contact": "wheel flanges and gauge: flange thickness, track gauge, clearance",
    "run_out": "wheel tread of {place}: out-of-roundness, mounting of the wheel and the axle box",
    "steady_force": "steady lateral forces: cant, side wind, drawgear, wheel load differences",
    "coach_mode": "carbody: its lateral mode takes part in the motion; measure it or extend the model",
    "rail_flexibility": "track: fastenings and lateral stiffness; measure the rails under load",
    "nonlinear_conicity": "wheel profiles: hollow wear; measure them and use them in the model",
    "gauge_conicity": "wheel and rail profiles with the gauge along the line",
    "rolling_line_offset": "wheel diameters and rail wear on the two sides",
    "rolling_line": "rail profiles along the line: side wear, grinding",
    "profile_shape": "wheel and rail profiles",
    "sensor_delay": "clock, filter and anti-alias settings of channel {place}",
    "sensor_gain": "calibration, mounting and unit of channel {place}",
    "sensor_offset": "zero of channel {place}",
}
CREEP = "adhesion: wet, greasy or contaminated rails, flange lubrication, weather of the day"
NONE = "nothing on the vehicle; effects below the minimum detectable sizes remain possible"
UNLOCATED = "no location is supported by the data; check synchronisation and mounting, then repeat with more sensors"
OTHER_SPEED = "a run at another speed or amplitude, with a sensor at this location, separates causes"


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
    kind, at = effect["kind"], effect["at"]
    if core.effect_record(kind)["acts"] == "creep":
        return CREEP
    is_rig = at == "rig"
    place = "the component" if is_rig else location_phrase(at, effect["wheelset"], structure).removeprefix("signal ")
    return BY_KIND.get(kind, "{place}").format(place=place)


def _discrepancy_line(outside: Mapping[str, Any], structure: Structure | None) -> str:
    if outside.get("parameter"):
        return f"conditions that change {outside['parameter']}: load, weather, wear between the runs"
    if not outside["at"]:
        return UNLOCATED
    if outside["at"] == "rig":
        return "the component: an effect that is in no law of the catalogue; compare with its force curve below"
    return f"{location_phrase(outside['at'], outside['wheelset'], structure)}; {OTHER_SPEED}"
