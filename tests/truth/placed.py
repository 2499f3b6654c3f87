"""Effects of a batch of vehicles side by side: fields of the contact chain, and groups of force laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from tests.truth.effects import KINDS, Effect, Kind
from tests.truth.laws import CREEP_LAWS, Array

# field of the contact chain that a contact effect sets: neutral value, then {kind: {parameter: field}}
NEUTRAL = {
    "mu": np.inf,
    "law": 0.0,
    "p_x": 1.0,
    "p_y": 1.0,
    "k_A": 1.0,
    "k_S": 1.0,
    "A": 1.0,
    "B": 0.0,
    "h": np.inf,
    "k_f": 0.0,
    "mu_f": 0.0,
    "d": 0.01,
    "gamma": 1.2217,
    "l3": 0.0,
    "lam_g": 0.0,
    "e_0": 0.0,
    "sway": 0.0,
    "wavelength": 1.0,
    "phase": 0.0,
    "k_r": 1.0,
    "c_r": 1.0,
    "yields": 0.0,
    "drift": 0.0,
    "depth": 0.0,
    "patch": 1.0,
}
CONTACT: dict[str, dict[str, str]] = {
    "creep_saturation": {"friction": "mu"},
    "vermeulen_johnson": {"friction": "mu", "longitudinal_factor": "p_x", "lateral_factor": "p_y"},
    "shen_hedrick_elkins": {"friction": "mu", "surface": "p_x"},
    "polach": {
        "friction": "mu",
        "adhesion_reduction": "k_A",
        "slip_reduction": "k_S",
        "friction_ratio": "A",
        "friction_decay": "B",
    },
    "flange_contact": {"clearance": "h", "stiffness": "k_f", "friction": "mu_f", "depth": "d", "angle": "gamma"},
    "nonlinear_conicity": {"cubic": "l3"},
    "gauge_conicity": {"per_gauge": "lam_g"},
    "rolling_line_offset": {"offset": "e_0", "sway": "sway", "wavelength": "wavelength", "phase": "phase"},
    "rail_flexibility": {"stiffness": "k_r", "damping": "c_r"},
    "conicity_drift": {"per_km": "drift"},
    "wet_patches": {"depth": "depth", "length": "patch"},
}


def contact_fields(batch: Sequence[Sequence[Effect]], clearances: Array) -> dict[str, Any]:
    """Contact effects of a batch as fields [wheelset, vehicle], neutral where there are none."""
    fields: dict[str, Any] = {name: np.full((2, len(batch)), value) for name, value in NEUTRAL.items()}
    fields["shape"], fields["line"] = {}, {}
    for k, effects in enumerate(batch):
        for one in (e for e in effects if e.kind == "profile_shape"):
            grid = np.array(one.parameters["displacement"])
            curves = {
                name: CubicSpline(grid, one.parameters[name], bc_type="natural")
                for name in ("radius", "radius_per_gauge", "angle")
            }
            fields["shape"] |= {(row, k): curves for row in range(2)[one.rows]}
        for one in (e for e in effects if e.kind == "rolling_line"):
            fields["line"] |= {(row, k): one.parameters for row in range(2)[one.rows]}
        for one in (e for e in effects if e.kind in CONTACT):
            p = {**one.filled()}
            if one.kind == "flange_contact" and p["clearance"] is None:
                p["clearance"] = clearances[k]
            for name, target in CONTACT[one.kind].items():
                fields[target][one.rows, k] = p[name]
            if one.kind in CREEP_LAWS:
                fields["law"][one.rows, k] = CREEP_LAWS.index(one.kind)
            if one.kind == "rail_flexibility":
                fields["yields"][one.rows, k] = 1.0
    return fields


@dataclass
class Group:
    """Effects of one kind at one place on several vehicles of a batch, their parameters side by side."""

    kind: Kind
    at: str
    rows: slice
    vehicles: Any  # slice, or index array, into the batch
    p: dict[str, Any]
    states: slice = field(default_factory=lambda: slice(0, 0))

    @property
    def shape(self) -> tuple[int, int, int]:
        """States of the kind, rows of the place, vehicles."""
        return self.kind.states, self.rows.stop - self.rows.start, len(self.p["k0"])


def grouped(batch: Sequence[Sequence[Effect]], declared: Callable[[int, str], tuple[float, float]]) -> list[Group]:
    """Force effects of a batch gathered by kind and place; declared(k, place): spring and damper there."""
    result: dict[tuple[str, str, slice | int, int], list[tuple[int, Effect]]] = {}
    for k, effects in enumerate(batch):
        seen: dict[tuple[str, str, int], int] = {}
        for one in effects:
            if KINDS[one.kind].law or KINDS[one.kind].many:
                label = (one.kind, one.at, one.wheelset or 0)
                seen[label] = seen.get(label, 0) + 1
                result.setdefault((*label, seen[label]), []).append((k, one))
    return [_group(members, len(batch), declared) for members in result.values()]


def _group(members: list[tuple[int, Effect]], size: int, declared: Callable[[int, str], tuple[float, float]]) -> Group:
    first, filled = members[0][1], [one.filled() for _, one in members]
    who = [k for k, _ in members]
    p: dict[str, Any] = {"at": first.at}
    for name in filled[0]:
        values = [f[name] for f in filled]
        p[name] = values if isinstance(values[0], str | list | tuple | np.ndarray) else np.array(values, float)
    p["k0"], p["c0"] = (np.array(x, float) for x in zip(*(declared(k, first.at) for k in who), strict=True))
    if first.kind == "frame_rumble":
        p["harmonics"] = [harmonics_of_rumble(f["highest"], int(f["seed"])) for f in filled]
    at = "linkage" if first.at == "wheelset_yaw" and first.wheelset is None else first.at
    rows = slice(0, 1) if at == "linkage" else first.rows
    return Group(KINDS[first.kind], at, rows, slice(None) if who == list(range(size)) else np.array(who), p)


def harmonics_of_rumble(highest: float, seed: int) -> tuple[Array, Array]:
    """Angular frequencies and phases of an unmeasured random force."""
    rng = np.random.default_rng([seed, 7])
    return 2.0 * np.pi * highest * (np.arange(60) + rng.random(60)) / 60.0, rng.uniform(0.0, 2.0 * np.pi, 60)
