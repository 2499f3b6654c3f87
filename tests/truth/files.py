"""Campaigns as files: names in design files, vehicle.yaml, campaign.yaml and gzipped runs."""

from __future__ import annotations

import gzip
import io
import json
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.truth.bogie import Vehicle
from tests.truth.laws import Array

# standard deviation in SI; the text is that of campaign.yaml
NOISE = {
    "yw": (2e-5, "0.02 mm"),
    "phiw": (2e-5, "0.02 mrad"),
    "gauge": (5e-5, "0.05 mm"),
    "e1": (5e-5, "0.05 mm"),
    "e2": (5e-5, "0.05 mm"),
    "ay1": (0.05, "0.05 m/s^2"),
    "ay2": (0.05, "0.05 m/s^2"),
    "ayf": (0.02, "0.02 m/s^2"),
    "rf": (3e-4, "0.3 mrad/s"),
    "d1": (2e-5, "0.02 mm"),
    "d2": (2e-5, "0.02 mm"),
    "psi1": (5e-5, "0.05 mrad"),
    "psi2": (5e-5, "0.05 mrad"),
    "Qy": (100.0, "100 N"),
    "Qpsi": (100.0, "100 N*m"),
}
UNITS = {
    **{"t": "s", "s": "m", "v": "m/s", "yw": "m", "phiw": "rad", "gauge": "m", "e1": "m", "e2": "m"},
    **{"ay1": "m/s^2", "ay2": "m/s^2", "ayf": "m/s^2", "rf": "rad/s", "d1": "m", "d2": "m"},
    **{"psi1": "rad", "psi2": "rad", "Qy": "N", "Qpsi": "N*m"},
}
DIGITS = {"s": "%.4f", "v": "%.4f"}
BODY = {
    "vehicle.frame": {"mass": "m_b", "yaw_inertia": "I_zb"},
    "vehicle.wheelset": {"mass": "m_a", "yaw_inertia": "I_za", "spin_inertia": "I_ya"},
    "vehicle.geometry": {
        "half_wheelbase": "a",
        "half_gauge": "b",
        "half_spring_base": "b_c",
        "rolling_radius": "r",
    },
    "vehicle.primary": {"lateral_stiffness": "c_y", "longitudinal_stiffness": "c_x"},
    "vehicle.secondary": {
        "lateral_stiffness": "c_sy",
        "yaw_stiffness": "c_spsi",
        "lateral_damping": "k_y",
        "yaw_damping": "k_psi",
    },
}
WHEEL = {
    "conicity": "lam",
    "longitudinal_creep": "kappa_x",
    "lateral_creep": "kappa_y",
    "gravitational_stiffness": "epsilon",
    "contact_angle": "delta",
    "roll": "sigma",
}


def paths(vehicle: Vehicle) -> dict[str, float]:
    """Every number of a vehicle under its name in design files."""
    result = {f"{group}.{name}": getattr(vehicle, x) for group, names in BODY.items() for name, x in names.items()}
    for i, wheelset in enumerate(("leading", "trailing")):
        result |= {f"contact.{wheelset}.{name}": getattr(vehicle, x)[i] for name, x in WHEEL.items()}
    rest = {"vehicle.wheel_load": vehicle.N, "contact.spin_creep": vehicle.kappa_s}
    return {**result, **rest, "contact.flange_clearance": vehicle.clearance}


def vehicle_of(values: Mapping[str, float], base: Vehicle) -> Vehicle:
    """A vehicle from numbers under their names in design files; what is not named stays as the base's."""
    names = {f"{group}.{name}": x for group, letters in BODY.items() for name, x in letters.items()}
    names |= {
        "vehicle.wheel_load": "N",
        "contact.spin_creep": "kappa_s",
        "contact.flange_clearance": "clearance",
    }
    for path, value in values.items():
        if path in names:
            base = replace(base, **_letter(names[path], value))
        else:
            _, wheelset, name = path.split(".")
            pair = list(getattr(base, WHEEL[name]))
            pair[("leading", "trailing").index(wheelset)] = value
            base = replace(base, **_letter(WHEEL[name], tuple(pair)))
    return base


def _letter(name: str, value: Any) -> dict[str, Any]:
    return {name: value}


def design(vehicle: Vehicle, name: str = "test bogie, declared values") -> str:
    """Text of a design file."""
    text = [f"name: {name}", "vehicle:"]
    for group, letters in BODY.items():
        text.append(f"  {group.split('.')[1]}: {_flow({k: getattr(vehicle, x) for k, x in letters.items()})}")
    text += [f"  wheel_load: {vehicle.N:.12g}", "contact:"]
    for i, wheelset in enumerate(("leading", "trailing")):
        text.append(f"  {wheelset}: {_flow({k: getattr(vehicle, x)[i] for k, x in WHEEL.items()})}")
    text += [f"  spin_creep: {vehicle.kappa_s:.12g}", f"  flange_clearance: {vehicle.clearance:.12g}"]
    return "\n".join(text) + "\n"


def _flow(values: Mapping[str, float]) -> str:
    return "{" + ", ".join(f"{k}: {x:.12g}" for k, x in values.items()) + "}"


def campaign_text(
    name: str, vehicle: str, noise: Mapping[str, str], noise_band: float = 2.5, runs: Iterable[str] = "ab"
) -> str:
    """Text of campaign.yaml; noise is column to quantity, the last run validates."""
    text = [f"name: {name}", f"vehicle: {vehicle}", "runs:"]
    *adjusting, validating = runs
    text += [f"  - {{file: run_{x}.csv.gz, role: adjust}}" for x in adjusting]
    text.append(f"  - {{file: run_{validating}.csv.gz, role: validate}}")
    if noise:
        text.append("noise: {" + ", ".join(f"{x}: {sd}" for x, sd in noise.items()) + "}")
    if noise_band != 2.5:
        text.append(f"noise_band: {noise_band:.12g} m")
    return "\n".join(text) + "\n"


def write_run(path: Path, run: Mapping[str, Array], units: Mapping[str, str], time: str = "%.3f") -> None:
    """One run as gzipped CSV, header `name [unit]`."""
    text = io.StringIO()
    digits = [{**DIGITS, "t": time}.get(name, "%.6g") for name in run]
    header = ",".join(f"{name} [{units[name]}]" for name in run)
    np.savetxt(text, np.stack(list(run.values()), axis=1), digits, ",", header=header, comments="")
    with path.open("wb") as raw, gzip.GzipFile("", "wb", 6, raw, mtime=0) as packed:
        packed.write(text.getvalue().encode())


def facts_text(facts: Mapping[str, Any]) -> str:
    """YAML of one line a fact, each value as JSON."""
    lines = [f"{k}: {json.dumps(x, default=lambda array: np.asarray(array).tolist())}" for k, x in facts.items()]
    return "\n".join(lines) + "\n"
