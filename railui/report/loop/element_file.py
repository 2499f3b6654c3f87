"""Export of the component that a bench campaign has identified, as an element that a design mounts."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.identification.result import LoopResult
from railui.io.atomic import write_text
from railui.io.schema_line import schema_name
from railui.io.yaml_writer import YamlWriter
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

FORCE_UNITS = {"m": "N", "rad": "N*m"}
SIGNIFICANT = 2.0  # standard deviations below 0
FASTEST = 100.0  # m/s or rad/s, end of a curve against the speed


class NoElementError(ValueError):
    """Units of runs or numbers that no element can have."""


def motion_unit(result: LoopResult) -> str:
    """Return the unit of the motion of a bench campaign, m or rad; NoElementError where its runs have other units."""
    units = result.dataset.runs[0].units
    motion = units.get("z", "")
    if FORCE_UNITS.get(motion) != units.get("F"):
        shown = f"z [{motion}], F [{units.get('F', '')}]"
        raise NoElementError(
            f"the runs give {shown}, which are no units of a displacement or rotation and its force: "
            "write the units in the headers, as z [mm], F [N]"
        )
    return motion


def element_text(result: LoopResult) -> str:
    """Return the element file of a loop: linear terms, laws in parallel and the range in which they were measured."""
    motion, model = motion_unit(result), result.after.model
    damping = _non_negative(result, "vehicle.rig.damping")
    stiffness, laws = _laws(model, _non_negative(result, "vehicle.rig.stiffness"), damping)
    force = FORCE_UNITS[motion]
    writer = YamlWriter()
    writer.entry("schema", schema_name("element"))
    writer.entry("name", result.dataset.campaign.name)
    writer.entry("motion", motion)
    writer.entry("stiffness", stiffness, comment=f"{force}/{motion}")
    writer.entry("damping", damping, comment=f"{force}*s/{motion}")
    writer.entry("preload", model.value("vehicle.rig.preload"), comment=force)
    writer.items("effects", laws)
    with writer.block("source"):
        for key, value in _source(result).items():
            writer.entry(key, value)
    return writer.text()


def write_element(result: LoopResult, path: str | Path) -> Path:
    """Write the element file of a loop, atomically; return the path."""
    return write_text(path, element_text(result))


def _non_negative(result: LoopResult, path: str) -> float:
    """Return a stiffness or damping; 0 for an estimate below it by less than its uncertainty.

    Raises NoElementError for one that is significantly negative, as in a magnetic spring.
    """
    fit = result.after
    value = fit.model.value(path)
    sd = dict(zip(fit.free.paths, fit.sd, strict=True)).get(path, 0.0)
    if value >= 0.0 or value > -SIGNIFICANT * sd:
        return max(value, 0.0)
    raise NoElementError(
        f"{path} is {value:.4g} +/- {sd:.2g}: an element has a stiffness and damping of 0 and more; "
        "state the law that makes it negative in the design of the campaign, for instance measured_force"
    )


def _laws(model: Model, stiffness: float, damping: float) -> tuple[float, list[dict[str, Any]]]:
    """Return the stiffness that remains and the laws without a location.

    Laws that refer to the spring or damper of their location are written so that they do not: a clearance before a
    spring is a stop, an asymmetric damper a curve of force against speed.
    """
    laws: list[dict[str, Any]] = []
    for effect in model.design.effects:
        if effect.kind == "free_play":
            laws.append({"kind": "bump_stop", "gap": effect.parameters["half_width"], "stiffness": stiffness})
            stiffness = 0.0
        elif effect.kind == "asymmetric_damper":
            force = [0.0, 0.0, -float(effect.parameters["ratio"]) * damping * FASTEST]  # type: ignore[arg-type]
            curve = {"motion": [-FASTEST, 0.0, FASTEST], "force": force}
            laws.append({"kind": "measured_force", "against": "v", **curve})
        else:
            laws.append(_entry(effect))
    return stiffness, laws


def _entry(effect: PlacedEffect) -> dict[str, Any]:
    return {key: value for key, value in effect.entry().items() if key not in ("at", "wheelset")}


def _source(result: LoopResult) -> dict[str, Any]:
    campaign, segments = result.dataset.campaign, result.dataset.estimation
    z = np.concatenate([s.columns["z"] for s in segments])
    speeds = np.concatenate([_speed(s.columns, s.dt) for s in segments])
    return {
        "campaign": campaign.name,
        "sha256": campaign.sha256,
        "nrmse": result.validations["after"].nrmse,
        "motion_range": [float(z.min()), float(z.max())],
        "speed_range": [float(speeds.min()), float(speeds.max())],
    }


def _speed(columns: Mapping[str, FloatArray], dt: float) -> FloatArray:
    return columns["vz"] if "vz" in columns else np.gradient(columns["z"], dt)
