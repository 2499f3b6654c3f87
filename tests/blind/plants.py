"""What a blind trial plants: every kind of the catalogue at its places, faults outside it, pairs, and nothing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.truth.campaign import Order
from tests.truth.effects import Effect, check_together, effect

# rms motion z and rate v of the declared bogie at 40 m/s on B176 low, and the forces that are usual there
USUAL = {
    "primary_lateral": {"z": 4.5e-4, "v": 1.4e-2, "k": 6e6, "F": 2.7e3},
    "primary_yaw": {"z": 2.4e-4, "v": 6e-3, "k": 1.6e7, "F": 3.9e3},
    "secondary_lateral": {"z": 2.5e-3, "v": 3.5e-2, "k": 4e5, "F": 2e3},
    "secondary_yaw": {"z": 6.3e-4, "v": 1.4e-2, "k": 2e6, "F": 2e3},
}
PAIRED = ("primary_lateral", "primary_yaw")
WEAK, STRONG = 0.0, 1.0
# kinds that do the same to within what a campaign shows
FAMILIES = (
    {"free_play", "bump_stop", "cubic_stiffness"},
    {"dry_friction", "hysteresis"},
    {"maxwell_damper", "hysteresis", "viscous_damper", "spring"},
    {"quadratic_damper", "viscous_damper", "asymmetric_damper"},
)


@dataclass(frozen=True)
class Plant:
    """What is planted: nothing, catalogue, two or outside; its effects; words that describe the nuisances."""

    sort: str
    effects: tuple[Effect, ...]
    order: Order

    @property
    def text(self) -> str:
        named = [f"{e.kind} {e.at}{f' {e.wheelset}' if e.wheelset else ''}" for e in self.effects] or ["nothing"]
        return " + ".join(named)

    @property
    def nuisance(self) -> str:
        """What is not as the campaign file declares it."""
        return "coloured" if self.order.coloured else "unmeasured" if self.order.unmeasured else ""


def between(weak: float, strong: float, size: float) -> float:
    """A strength from weak (size 0) to strong (1), in equal ratios."""
    return weak * (strong / weak) ** size


def suspended(kind: str, at: str, wheelset: int | None, size: float) -> Effect:
    """An effect at a suspension, weak or strong against the forces that are usual there."""
    u = USUAL[at]
    z, v, k, force = u["z"], u["v"], u["k"], u["F"]
    own = {
        "spring": {"stiffness": between(0.4, 1.0, size) * k},
        "viscous_damper": {"damping": between(0.15, 0.5, size) * force / v},
        "free_play": {"half_width": between(0.5, 1.2, size) * z},
        "cubic_stiffness": {"stiffness": between(0.03, 0.12, size) * k / z**2},
        "quadratic_stiffness": {"stiffness": between(0.05, 0.12, size) * k / z},
        "bump_stop": {"gap": between(1.2, 0.8, size) * z, "stiffness": between(1.5, 3.0, size) * k},
        "dry_friction": {"force": between(0.25, 0.7, size) * force, "slip_speed": 0.15 * v},
        "hysteresis": {"stiffness": between(1.0, 2.0, size) * k, "yield": between(0.3, 0.8, size) * force},
        "quadratic_damper": {"damping": between(0.1, 0.25, size) * force / v**2},
        "asymmetric_damper": {"ratio": between(0.5, 1.0, size)},
        "maxwell_damper": {"stiffness": between(0.6, 1.5, size) * k, "damping": between(0.6, 1.5, size) * force / v},
    }
    return effect(kind, at, wheelset, **own[kind])


def elsewhere(kind: str, at: str, wheelset: int | None, size: float) -> Effect:
    """An effect at the contact, the rails, a wheelset, the coach or a sensor."""
    own: dict[str, dict[str, float]] = {
        "creep_saturation": {"friction": between(0.25, 0.12, size)},
        "flange_contact": {"clearance": between(2.5e-3, 1.8e-3, size), "stiffness": between(3e6, 1e7, size)},
        "nonlinear_conicity": {"cubic": between(3e4, 1e5, size)},
        "gauge_conicity": {"per_gauge": between(-15.0, -40.0, size)},
        "rail_flexibility": {"stiffness": between(3e7, 1e7, size), "damping": 1e5},
        "run_out": {"force": between(1.5e3, 5e3, size), "rolling_radius": 0.4605},
        "coach_mode": {"mass": between(1.5e4, 7e3, size), "stiffness": between(2e5, 4e5, size), "damping": 3e4},
        "sensor_delay": {"delay": between(4e-3, 1.2e-2, size)},
        "sensor_gain": {"gain": between(0.9, 0.75, size)},
        "spring": {"stiffness": between(3e6, 8e6, size)},
        "viscous_damper": {"damping": between(5e4, 1.5e5, size)},
    }
    return effect(kind, at, wheelset, **own[kind])


def catalogue() -> list[tuple[str, str, int | None]]:
    """Kind, place and wheelset of every effect that adjusting the declared parameters cannot absorb."""
    found: list[tuple[str, str, int | None]] = []
    for kind in ("free_play", "cubic_stiffness", "quadratic_stiffness", "bump_stop", "dry_friction", "hysteresis"):
        found += [(kind, at, w) for at in USUAL for w in ((None, 1, 2) if at in PAIRED else (None,))]
    found += [("maxwell_damper", at, w) for at in USUAL for w in ((None, 2) if at in PAIRED else (None,))]
    # against a wheelset's yaw it is so stiff that the generator wants hundreds of steps per sample
    found += [("quadratic_damper", at, None) for at in ("primary_lateral", "secondary_lateral", "secondary_yaw")]
    found += [("asymmetric_damper", "secondary_lateral", None), ("spring", "secondary_lateral", None)]
    found += [("spring", "secondary_yaw", None), ("spring", "primary_lateral", 1), ("spring", "primary_yaw", 2)]
    found += [("viscous_damper", at, w) for at in PAIRED for w in (None, 1)]
    found += [("spring", "wheelset_yaw", None), ("viscous_damper", "wheelset_yaw", None)]
    for kind in ("creep_saturation", "flange_contact", "nonlinear_conicity", "gauge_conicity"):
        found += [(kind, "contact", None), (kind, "contact", 2)]
    found += [("rail_flexibility", "track", None), ("run_out", "wheelset", 1), ("run_out", "wheelset", 2)]
    found += [("coach_mode", "secondary_lateral", None)]
    found += [(kind, at, None) for kind in ("sensor_delay", "sensor_gain") for at in ("e1", "ay2", "rf", "d2")]
    return found


def made(what: tuple[str, str, int | None], size: float) -> Effect:
    """The effect of a row of the catalogue."""
    kind, at, wheelset = what
    return (suspended if at in USUAL and kind != "coach_mode" else elsewhere)(kind, at, wheelset, size)


# the ten faults that no catalogue lists, some at two places
OUTSIDE = (
    effect("conicity_drift", "contact", per_km=0.3),
    effect("wet_patches", "contact", depth=0.6, length=150.0),
    effect("primary_drift", "primary_lateral", share=-0.6),
    effect("lateral_yaw_coupling", "primary_lateral", stiffness=4e6),
    effect("crossed_damping", "wheelset", damping=2e4),
    effect("frame_rumble", "frame", force=1500.0),
    effect("ageing_friction", "primary_lateral", force=1500.0, slip_speed=5e-3, rise=3.0),
    effect("switching_damper", "secondary_lateral", damping=4e4),
    effect("fading_damper", "secondary_lateral", damping=1.2e5, energy=60.0),
    effect("hung_mass", "frame", mass=800.0, stiffness=8e5, damping=2e3),
    effect("primary_drift", "primary_yaw", share=-0.5),
    effect("ageing_friction", "secondary_yaw", force=1500.0, slip_speed=5e-3, rise=3.0),
)


def drawn(count: int, seed: int, seconds: tuple[float, float]) -> list[Plant]:
    """A trial: 30 % with nothing, 15 % with two effects, 20 % outside the catalogue, the rest one effect each."""
    rng = np.random.default_rng([seed, 41])
    entries = catalogue()
    turn = [entries[i] for i in rng.permutation(len(entries))]
    strangers = [OUTSIDE[i] for i in rng.permutation(len(OUTSIDE))]
    sorts = ("nothing", "catalogue", "outside", "catalogue", "two", "nothing", "catalogue", "outside", "nothing",
             "catalogue", "two", "nothing", "catalogue", "outside", "catalogue", "nothing", "two", "catalogue",
             "outside", "nothing")  # fmt: skip
    plants = []
    for i in range(count):
        sort = sorts[i % len(sorts)]
        order = Order(seed=seed + i, name=f"blind {seed + i}", seconds=seconds)
        nuisance = rng.uniform()
        if nuisance < 0.15:
            order = replace(order, coloured=0.02)
        elif nuisance < 0.30:
            order = replace(order, unmeasured=100.0)
        found: tuple[Effect, ...] = ()
        if sort == "catalogue":
            found = (made(turn.pop(0), float(rng.uniform(WEAK, STRONG))),)
            turn = turn or [entries[k] for k in rng.permutation(len(entries))]
        elif sort == "outside":
            found = (strangers.pop(0),)
            strangers = strangers or [OUTSIDE[k] for k in rng.permutation(len(OUTSIDE))]
        elif sort == "two":
            found = _pair(rng, entries)
        plants.append(Plant(sort, found, replace(order, effects=found)))
    return plants


def _pair(rng: np.random.Generator, entries: list[tuple[str, str, int | None]]) -> tuple[Effect, ...]:
    """Two strong effects of different kinds at different places."""
    while True:
        pair = [made(entries[int(k)], STRONG) for k in rng.choice(len(entries), 2, replace=False)]
        if pair[0].kind != pair[1].kind and pair[0].at != pair[1].at:
            check_together(pair)
            return tuple(pair)


def alike(kind: str, other: str) -> bool:
    """Are two kinds the same to within what a campaign shows?"""
    return kind == other or any({kind, other} <= family for family in FAMILIES)


# kinds and places whose stated floor is planted, and what else the plant needs: usual sizes of the declared bogie
FLOORS = {
    **{("free_play", at): "half_width" for at in USUAL},
    **{("dry_friction", at): "force" for at in USUAL},
    **{("cubic_stiffness", at): "stiffness" for at in USUAL},
    **{("quadratic_stiffness", at): "stiffness" for at in USUAL},
    ("creep_saturation", "contact"): "friction",
    ("gauge_conicity", "contact"): "per_gauge",
    ("nonlinear_conicity", "contact"): "cubic",
    ("spring", "wheelset_yaw"): "stiffness",
    ("viscous_damper", "wheelset_yaw"): "damping",
    ("viscous_damper", "primary_lateral"): "damping",
    ("viscous_damper", "primary_yaw"): "damping",
}


def at_floor(plant: Plant, row: dict[str, Any], factor: float) -> Plant:
    """The campaign of a plant with so many times the floor that a report stated for an effect."""
    usual = made((row["kind"], row["at"], row["wheelset"]), STRONG)
    value = row["value"] / factor if row["kind"] == "creep_saturation" else row["value"] * factor
    planted = replace(usual, parameters={**usual.parameters, row["parameter"]: value})
    name = f"{plant.order.name} at {factor:g} times the floor"
    return Floored("floor", (planted,), replace(plant.order, effects=(planted,), name=name), factor)


@dataclass(frozen=True)
class Floored(Plant):
    """An effect as strong as a share of the floor that a report stated."""

    factor: float = 1.0

    @property
    def text(self) -> str:
        return f"{super().text}, floor x {self.factor:g}"
