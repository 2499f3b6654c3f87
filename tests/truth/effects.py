"""The catalogue of effects: what the linear bogie lacks, where it sits, and how it is written down."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from tests.truth import laws, outside
from tests.truth.laws import Array

SUSPENSIONS = ("primary_lateral", "primary_yaw", "secondary_lateral", "secondary_yaw")
PLACES = (*SUSPENSIONS, "wheelset", "wheelset_yaw", "frame", "frame_yaw", "contact")
PAIRED = (
    "primary_lateral",
    "primary_yaw",
    "wheelset",
    "wheelset_yaw",
    "contact",
    "track",
)  # one per wheelset
SPRUNG = (*SUSPENSIONS, "rig")


@dataclass(frozen=True)
class Kind:
    """Kind of effect: locations, required parameters, law and properties of the law."""

    at: tuple[str, ...]
    needs: tuple[str, ...]
    optional: Mapping[str, Any] = field(default_factory=dict)
    law: laws.ForceLaw | None = None  # force at its place
    many: outside.OutsideLaw | None = None  # force at several places
    states: int = 0
    rates: bool = True  # the law asks for v
    supersedes: str = ""  # "spring" or "spring and damper" of the declaration
    cycle: str = ""  # over a closed cycle: "loss" or "none"
    odd: bool = True
    silent: bool = True  # no force at rest
    catalogued: bool = True
    whole: bool = False  # of the bogie: it takes no wheelset
    # parameters with which tests try it, from the motion z, the speed v and a stiffness k usual at a place
    example: Callable[[float, float, float], dict[str, Any]] | None = None


def force(law: laws.ForceLaw, *needs: str, at: Sequence[str] = SPRUNG, **rest: Any) -> Kind:
    return Kind(at=tuple(at), needs=needs, law=law, **rest)


def stranger(law: outside.OutsideLaw, *needs: str, at: Sequence[str], **rest: Any) -> Kind:
    return Kind(at=tuple(at), needs=needs, many=law, catalogued=False, **rest)


KINDS: dict[str, Kind] = {
    "spring": force(
        laws.spring,
        "stiffness",
        at=(*SPRUNG, "wheelset_yaw"),
        cycle="none",
        rates=False,
        example=lambda z, v, k: {"stiffness": 0.3 * k},
    ),
    "viscous_damper": force(
        laws.viscous_damper,
        "damping",
        at=(*SPRUNG, "wheelset_yaw"),
        cycle="loss",
        example=lambda z, v, k: {"damping": 0.2 * k * z / v},
    ),
    "free_play": force(
        laws.free_play,
        "half_width",
        supersedes="spring",
        cycle="none",
        rates=False,
        example=lambda z, v, k: {"half_width": 0.5 * z},
    ),
    "cubic_stiffness": force(
        laws.cubic_stiffness,
        "stiffness",
        cycle="none",
        rates=False,
        example=lambda z, v, k: {"stiffness": 0.1 * k / z**2},
    ),
    "quadratic_stiffness": force(
        laws.quadratic_stiffness,
        "stiffness",
        cycle="none",
        odd=False,
        rates=False,
        example=lambda z, v, k: {"stiffness": 0.07 * k / z},
    ),
    "bump_stop": force(
        laws.bump_stop,
        "gap",
        "stiffness",
        cycle="none",
        rates=False,
        example=lambda z, v, k: {"gap": 0.5 * z, "stiffness": 0.6 * k},
    ),
    "dry_friction": force(
        laws.dry_friction,
        "force",
        "slip_speed",
        cycle="loss",
        example=lambda z, v, k: {"force": 0.3 * k * z, "slip_speed": 0.7 * v},
    ),
    "hysteresis": force(
        laws.hysteresis,
        "stiffness",
        "yield",
        states=1,
        cycle="loss",
        example=lambda z, v, k: {"stiffness": 0.5 * k, "yield": 0.5 * k * z},
    ),
    "quadratic_damper": force(
        laws.quadratic_damper, "damping", cycle="loss", example=lambda z, v, k: {"damping": 0.1 * k * z / v**2}
    ),
    # a primary has no declared damper, so there the law would be nothing at all
    "asymmetric_damper": force(
        laws.asymmetric_damper,
        "ratio",
        at=("secondary_lateral", "secondary_yaw", "rig"),
        cycle="loss",
        odd=False,
        example=lambda z, v, k: {"ratio": 0.8},
    ),
    "maxwell_damper": force(
        laws.maxwell_damper,
        "stiffness",
        "damping",
        optional={"blow_off": np.inf},
        states=1,
        cycle="loss",
        example=lambda z, v, k: {"stiffness": 0.3 * k, "damping": 0.3 * k * z / v},
    ),
    "creep_saturation": Kind(("contact",), ("friction",), supersedes="creep forces"),
    "vermeulen_johnson": Kind(
        ("contact",),
        ("friction",),
        {"longitudinal_factor": 1.0, "lateral_factor": 1.0},
        supersedes="creep forces",
    ),
    "shen_hedrick_elkins": Kind(("contact",), ("friction",), {"surface": 1.0}, supersedes="creep forces"),
    "polach": Kind(
        ("contact",),
        ("friction",),
        {"adhesion_reduction": 1.0, "slip_reduction": 1.0, "friction_ratio": 1.0, "friction_decay": 0.0},
        supersedes="creep forces",
    ),
    "profile_shape": Kind(
        ("contact",), ("displacement", "radius", "radius_per_gauge", "angle"), supersedes="rolling radii", odd=False
    ),
    "flange_contact": Kind(
        ("contact",),
        ("stiffness",),
        {"clearance": None, "friction": 0.0, "depth": 0.01, "angle": 1.2217},
        cycle="none",
        rates=False,
    ),
    "nonlinear_conicity": Kind(("contact",), ("cubic",)),
    "gauge_conicity": Kind(("contact",), ("per_gauge",)),
    "rolling_line_offset": Kind(
        ("contact",),
        (),
        {"offset": 0.0, "sway": 0.0, "wavelength": 100.0, "phase": 0.0},
        odd=False,
        silent=False,
    ),
    "rolling_line": Kind(("contact",), ("place", "offset"), odd=False, silent=False),
    "rail_flexibility": Kind(("track",), ("stiffness", "damping"), cycle="loss"),
    "run_out": force(
        laws.run_out,
        "force",
        "rolling_radius",
        at=("wheelset",),
        optional={"phase": 0.0},
        silent=False,
        example=lambda z, v, k: {"force": 3e3, "rolling_radius": 0.4623, "phase": 0.7},
    ),
    "steady_force": force(
        laws.steady_force,
        "force",
        at=("frame", "frame_yaw"),
        odd=False,
        silent=False,
        example=lambda z, v, k: {"force": 0.3 * k * z},
    ),
    "coach_mode": Kind(
        ("secondary_lateral",), ("mass", "stiffness", "damping"), supersedes="spring and damper", cycle="loss"
    ),
    "measured_force": force(
        laws.measured_force, "motion", "force", at=(*PLACES, "rig"), optional={"against": "z"}, odd=False
    ),
    "sensor_delay": Kind((), ("delay",)),
    "sensor_gain": Kind((), ("gain",)),
    "sensor_offset": Kind((), ("offset",), odd=False),
    "conicity_drift": Kind(("contact",), ("per_km",), catalogued=False),
    "wet_patches": Kind(("contact",), ("depth", "length"), catalogued=False),
    "primary_drift": stranger(
        outside.primary_drift, "share", at=("primary_lateral", "primary_yaw"), optional={"seconds": 60.0}
    ),
    "lateral_yaw_coupling": stranger(outside.lateral_yaw_coupling, "stiffness", at=("primary_lateral",)),
    "crossed_damping": stranger(outside.crossed_damping, "damping", at=("wheelset",), whole=True),
    "frame_rumble": stranger(
        outside.frame_rumble,
        "force",
        at=("frame", "frame_yaw"),
        optional={"highest": 10.0, "seed": 0},
        silent=False,
    ),
    "ageing_friction": stranger(
        outside.ageing_friction,
        "force",
        "slip_speed",
        at=SUSPENSIONS,
        optional={"rise": 1.0, "healing": 0.5},
        states=1,
    ),
    "switching_damper": stranger(
        outside.switching_damper, "damping", at=SUSPENSIONS, optional={"depth": 0.8, "period": 7.0}
    ),
    "fading_damper": stranger(
        outside.fading_damper, "damping", "energy", at=SUSPENSIONS, optional={"cooling": 20.0}, states=1
    ),
    "hung_mass": stranger(outside.hung_mass, "mass", "stiffness", "damping", at=("frame", "frame_yaw"), states=2),
}


@dataclass(frozen=True)
class Effect:
    """One effect at one place; wheelset None means both (at wheelset_yaw: the linkage psi_1 + psi_2)."""

    kind: str
    at: str
    wheelset: int | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)

    @property
    def rows(self) -> slice:
        """Rows of its place that it sits on."""
        if self.wheelset is None:
            return slice(0, 2 if self.at in PAIRED else 1)
        return slice(self.wheelset - 1, self.wheelset)

    def filled(self) -> dict[str, Any]:
        """Parameters with the defaults put in."""
        return {**KINDS[self.kind].optional, **self.parameters}

    def record(self) -> dict[str, Any]:
        """As it stands in a design file."""
        place = {} if self.wheelset is None else {"wheelset": self.wheelset}
        return {"kind": self.kind, "at": self.at, **place, **self.parameters}


def effect(kind: str, at: str, wheelset: int | None = None, **parameters: Any) -> Effect:
    """A checked effect; raises ValueError with the remedy."""
    if kind not in KINDS:
        raise ValueError(f"no effect {kind!r}; there are {', '.join(KINDS)}")
    known = KINDS[kind]
    if known.at and at not in known.at:
        raise ValueError(f"{kind} cannot sit at {at}; it can at {', '.join(known.at)}")
    if wheelset is not None and (wheelset not in (1, 2) or at not in PAIRED or known.whole):
        raise ValueError(f"wheelset {wheelset} at {at}: 1 or 2, and only at {', '.join(PAIRED)}")
    allowed = {*known.needs, *known.optional}
    if not set(known.needs) <= set(parameters) <= allowed:
        raise ValueError(f"{kind} takes {sorted(allowed)}, was given {sorted(parameters)}")
    return Effect(kind, at, wheelset, parameters)


def parse(text: str) -> Effect:
    """'free_play at=primary_lateral wheelset=2 half_width=0.3e-3' to an effect."""
    kind, *words = text.split()
    pairs = dict(word.split("=", 1) for word in words)
    at = pairs.pop("at", (*KINDS[kind].at, "")[0] if kind in KINDS else "")
    wheelset = pairs.pop("wheelset", None)
    numbers = {k: w if k == "against" else _numbers(w) for k, w in pairs.items()}
    return effect(kind, at, int(wheelset) if wheelset else None, **numbers)


def _numbers(word: str) -> float | list[float]:
    return [float(x) for x in word.split(",")] if "," in word else float(word)


def of_one_run(effects: Iterable[Effect], rng: np.random.Generator) -> list[Effect]:
    """The effects with what belongs to a run drawn: the phase of a run-out, the seed of a rumble."""
    drawn = []
    for one in effects:
        own: dict[str, Any] = {}
        if one.kind == "run_out" and "phase" not in one.parameters:
            own = {"phase": rng.uniform(0.0, 2.0 * np.pi)}
        elif one.kind == "frame_rumble" and "seed" not in one.parameters:
            own = {"seed": int(rng.integers(2**31))}
        drawn.append(replace(one, parameters={**one.parameters, **own}))
    return drawn


def check_together(effects: Sequence[Effect]) -> None:
    """Raises ValueError where two effects supersede the same term, or one kind sits twice in a contact."""
    taken: dict[tuple[str, str, int], str] = {}
    for one in effects:
        what = [w for w in ("spring", "damper", "creep forces", "rolling radii") if w in KINDS[one.kind].supersedes]
        what += [one.kind] if one.at in ("contact", "track") and KINDS[one.kind].law is None else []
        for key in [(w, one.at, row) for w in what for row in range(2)[one.rows]]:
            if key in taken:
                raise ValueError(f"{one.kind} and {taken[key]} both supersede the {key[0]} at {one.at}")
            taken[key] = one.kind


def sense(channels: Mapping[str, Array], t: Array, effects: Iterable[Effect]) -> dict[str, Array]:
    """Channels as faulty sensors give them: x(t) -> gain x(t - delay) + offset; NaN with a delay where any is NaN."""
    seen = dict(channels)
    sensors = [e for e in effects if e.kind.startswith("sensor_")]
    order = ("sensor_delay", "sensor_gain", "sensor_offset")
    for one in sorted(sensors, key=lambda e: order.index(e.kind)):
        x, p = seen[one.at], one.filled()
        if one.kind == "sensor_delay":
            is_finite = bool(np.isfinite(x).all())
            x = CubicSpline(t, x)(np.maximum(t - p["delay"], t[0])) if is_finite else np.full_like(x, np.nan)
        seen[one.at] = p.get("gain", 1.0) * x + p.get("offset", 0.0)
    return seen
