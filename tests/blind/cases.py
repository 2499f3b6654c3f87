"""Cases of a blind trial: library effects at their locations, effects not in the library, pairs, and none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.truth.campaign import Order
from tests.truth.effects import Effect, check_together, effect

# rms motion z and velocity v of the nominal bogie at 40 m/s on B176 low, with typical stiffness k and force F
TYPICAL_MOTION = {
    "primary_lateral": {"z": 4.5e-4, "v": 1.4e-2, "k": 6e6, "F": 2.7e3},
    "primary_yaw": {"z": 2.4e-4, "v": 6e-3, "k": 1.6e7, "F": 3.9e3},
    "secondary_lateral": {"z": 2.5e-3, "v": 3.5e-2, "k": 4e5, "F": 2e3},
    "secondary_yaw": {"z": 6.3e-4, "v": 1.4e-2, "k": 2e6, "F": 2e3},
}
PRIMARY_LOCATIONS = ("primary_lateral", "primary_yaw")
WEAK, STRONG = 0.0, 1.0
# responses that are not recorded
SENSOR_SETS: dict[str, tuple[str, ...]] = {
    "all": (),
    "no rail position": ("e1", "e2"),
    "accelerometers and gyro": ("e1", "e2", "d1", "d2"),
    "accelerometers": ("e1", "e2", "d1", "d2", "rf"),
    "no accelerometers": ("ay1", "ay2", "ayf"),
}
# kinds that a campaign cannot distinguish
FAMILIES = (
    {"free_play", "bump_stop", "cubic_stiffness"},
    {"dry_friction", "hysteresis"},
    {"maxwell_damper", "hysteresis", "viscous_damper", "spring"},
    {"quadratic_damper", "viscous_damper", "asymmetric_damper"},
)


@dataclass(frozen=True)
class PlantedCase:
    """A case: its sort (nothing, catalogue, two, outside or floor), its effects and the order of its campaign."""

    sort: str
    effects: tuple[Effect, ...]
    order: Order

    @property
    def text(self) -> str:
        named = [f"{e.kind} {e.at}{f' {e.wheelset}' if e.wheelset else ''}" for e in self.effects] or ["nothing"]
        return " + ".join(named)

    @property
    def nuisance(self) -> str:
        """Disturbance that the campaign file does not state, or states wrongly."""
        order = self.order
        known = {"coloured": order.coloured, "1/f": order.pink, "unmeasured": order.unmeasured}
        known |= {"unstated": order.stated == 0.0, "wrong": order.stated not in (0.0, 1.0)}
        return " ".join(name for name, is_so in known.items() if is_so)

    @property
    def sensors(self) -> str:
        """Name of the set of recorded responses."""
        return next((name for name, out in SENSOR_SETS.items() if set(out) == set(self.order.without)), "other")


def interpolate(weak: float, strong: float, size: float) -> float:
    """Interpolate a strength geometrically from weak (size 0) to strong (size 1)."""
    return weak * (strong / weak) ** size


def suspension_effect(kind: str, at: str, wheelset: int | None, size: float) -> Effect:
    """Create an effect at a suspension, of a size relative to the typical forces there."""
    return effect(kind, at, wheelset, **suspension_parameters(kind, TYPICAL_MOTION[at], size))


def suspension_parameters(kind: str, motion: Mapping[str, float], size: float) -> dict[str, float]:
    """Compute the parameters of an effect from typical motion, stiffness and force at its location."""
    z, v, k, force = motion["z"], motion["v"], motion["k"], motion["F"]
    parameters: dict[str, dict[str, float]] = {
        "spring": {"stiffness": interpolate(0.4, 1.0, size) * k},
        "viscous_damper": {"damping": interpolate(0.15, 0.5, size) * force / v},
        "free_play": {"half_width": interpolate(0.5, 1.2, size) * z},
        "cubic_stiffness": {"stiffness": interpolate(0.03, 0.12, size) * k / z**2},
        "quadratic_stiffness": {"stiffness": interpolate(0.05, 0.12, size) * k / z},
        "bump_stop": {"gap": interpolate(1.2, 0.8, size) * z, "stiffness": interpolate(1.5, 3.0, size) * k},
        "dry_friction": {"force": interpolate(0.25, 0.7, size) * force, "slip_speed": 0.15 * v},
        "hysteresis": {"stiffness": interpolate(1.0, 2.0, size) * k, "yield": interpolate(0.3, 0.8, size) * force},
        "quadratic_damper": {"damping": interpolate(0.1, 0.25, size) * force / v**2},
        "asymmetric_damper": {"ratio": interpolate(0.5, 1.0, size)},
        "maxwell_damper": {
            "stiffness": interpolate(0.6, 1.5, size) * k,
            "damping": interpolate(0.6, 1.5, size) * force / v,
        },
    }
    return parameters[kind]


def other_effect(kind: str, at: str, wheelset: int | None, size: float) -> Effect:
    """Create an effect at the contact, the rails, a wheelset, the carbody or a sensor."""
    parameters: dict[str, dict[str, float]] = {
        "creep_saturation": {"friction": interpolate(0.25, 0.12, size)},
        "flange_contact": {"clearance": interpolate(2.5e-3, 1.8e-3, size), "stiffness": interpolate(3e6, 1e7, size)},
        "nonlinear_conicity": {"cubic": interpolate(3e4, 1e5, size)},
        "gauge_conicity": {"per_gauge": interpolate(-15.0, -40.0, size)},
        "rail_flexibility": {"stiffness": interpolate(3e7, 1e7, size), "damping": 1e5},
        "run_out": {"force": interpolate(1.5e3, 5e3, size), "rolling_radius": 0.4605},
        "coach_mode": {"mass": interpolate(1.5e4, 7e3, size), "stiffness": interpolate(2e5, 4e5, size), "damping": 3e4},
        "sensor_delay": {"delay": interpolate(4e-3, 1.2e-2, size)},
        "sensor_gain": {"gain": interpolate(0.9, 0.75, size)},
        "spring": {"stiffness": interpolate(3e6, 8e6, size)},
        "viscous_damper": {"damping": interpolate(5e4, 1.5e5, size)},
    }
    return effect(kind, at, wheelset, **parameters[kind])


def library_entries() -> list[tuple[str, str, int | None]]:
    """List kind, location and wheelset of every effect that the estimated parameters cannot absorb."""
    entries: list[tuple[str, str, int | None]] = []
    for kind in ("free_play", "cubic_stiffness", "quadratic_stiffness", "bump_stop", "dry_friction", "hysteresis"):
        entries += [
            (kind, at, w) for at in TYPICAL_MOTION for w in ((None, 1, 2) if at in PRIMARY_LOCATIONS else (None,))
        ]
    entries += [
        ("maxwell_damper", at, w) for at in TYPICAL_MOTION for w in ((None, 2) if at in PRIMARY_LOCATIONS else (None,))
    ]
    # on the yaw of a wheelset it is so stiff that the generator needs hundreds of steps per sample
    entries += [("quadratic_damper", at, None) for at in ("primary_lateral", "secondary_lateral", "secondary_yaw")]
    entries += [("asymmetric_damper", "secondary_lateral", None), ("spring", "secondary_lateral", None)]
    entries += [("spring", "secondary_yaw", None), ("spring", "primary_lateral", 1), ("spring", "primary_yaw", 2)]
    entries += [("viscous_damper", at, w) for at in PRIMARY_LOCATIONS for w in (None, 1)]
    entries += [("spring", "wheelset_yaw", None), ("viscous_damper", "wheelset_yaw", None)]
    for kind in ("creep_saturation", "flange_contact", "nonlinear_conicity", "gauge_conicity"):
        entries += [(kind, "contact", None), (kind, "contact", 2)]
    entries += [("rail_flexibility", "track", None), ("run_out", "wheelset", 1), ("run_out", "wheelset", 2)]
    entries += [("coach_mode", "secondary_lateral", None)]
    entries += [(kind, at, None) for kind in ("sensor_delay", "sensor_gain") for at in ("e1", "ay2", "rf", "d2")]
    return entries


def planted_effect(entry: tuple[str, str, int | None], size: float) -> Effect:
    """Create the effect of a library entry."""
    kind, at, wheelset = entry
    return (suspension_effect if at in TYPICAL_MOTION and kind != "coach_mode" else other_effect)(
        kind, at, wheelset, size
    )


# ten faults that are not in the library, some at two locations
EFFECTS_NOT_IN_LIBRARY = (
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


def draw_cases(count: int, seed: int, seconds: tuple[float, float]) -> list[PlantedCase]:
    """Draw cases: 30 % without effect, 15 % with two, 20 % with one not in the library, the others with one."""
    rng = np.random.default_rng([seed, 41])
    entries = library_entries()
    order_of_entries = [entries[i] for i in rng.permutation(len(entries))]
    not_in_library = [EFFECTS_NOT_IN_LIBRARY[i] for i in rng.permutation(len(EFFECTS_NOT_IN_LIBRARY))]
    sorts = ("nothing", "catalogue", "outside", "catalogue", "two", "nothing", "catalogue", "outside", "nothing",
             "catalogue", "two", "nothing", "catalogue", "outside", "catalogue", "nothing", "two", "catalogue",
             "outside", "nothing")  # fmt: skip
    cases = []
    for i in range(count):
        sort = sorts[i % len(sorts)]
        order = Order(seed=seed + i, name=f"blind {seed + i}", seconds=seconds)
        nuisance = rng.uniform()
        if nuisance < 0.15:
            order = replace(order, coloured=0.02)
        elif nuisance < 0.30:
            order = replace(order, unmeasured=100.0)
        effects: tuple[Effect, ...] = ()
        if sort == "catalogue":
            effects = (planted_effect(order_of_entries.pop(0), float(rng.uniform(WEAK, STRONG))),)
            order_of_entries = order_of_entries or [entries[k] for k in rng.permutation(len(entries))]
        elif sort == "outside":
            effects = (not_in_library.pop(0),)
            not_in_library = not_in_library or [
                EFFECTS_NOT_IN_LIBRARY[k] for k in rng.permutation(len(EFFECTS_NOT_IN_LIBRARY))
            ]
        elif sort == "two":
            effects = _pair(rng, entries)
        cases.append(PlantedCase(sort, effects, replace(order, effects=effects)))
    return cases


def _pair(rng: np.random.Generator, entries: list[tuple[str, str, int | None]]) -> tuple[Effect, ...]:
    """Draw two strong effects of different kinds at different locations."""
    while True:
        pair = [planted_effect(entries[int(k)], STRONG) for k in rng.choice(len(entries), 2, replace=False)]
        if pair[0].kind != pair[1].kind and pair[0].at != pair[1].at:
            check_together(pair)
            return tuple(pair)


# elements of a coach that join the same bodies in the same direction, by the one that stands for them here
SAME_JOINT = {
    "lateral_damper_lateral": "secondary_lateral",
    "secondary_damper_roll": "anti_roll_bar_roll",
    "secondary_roll": "anti_roll_bar_roll",
    "primary_damper_roll": "primary_roll",
}


def joint_of(at: str) -> str:
    """Name the joint of a location: elements between the same bodies act on the same motion."""
    return SAME_JOINT.get(at, at)


def is_same_family(kind: str, other: str) -> bool:
    """True if a campaign cannot distinguish two kinds."""
    return kind == other or any({kind, other} <= family for family in FAMILIES)


# parameter that scales the minimum detectable effect, by kind and location
DETECTABLE_PARAMETERS = {
    **{("free_play", at): "half_width" for at in TYPICAL_MOTION},
    **{("dry_friction", at): "force" for at in TYPICAL_MOTION},
    **{("cubic_stiffness", at): "stiffness" for at in TYPICAL_MOTION},
    **{("quadratic_stiffness", at): "stiffness" for at in TYPICAL_MOTION},
    ("creep_saturation", "contact"): "friction",
    ("gauge_conicity", "contact"): "per_gauge",
    ("nonlinear_conicity", "contact"): "cubic",
    ("spring", "wheelset_yaw"): "stiffness",
    ("viscous_damper", "wheelset_yaw"): "damping",
    ("viscous_damper", "primary_lateral"): "damping",
    ("viscous_damper", "primary_yaw"): "damping",
}


def with_detectable_effect(case: PlantedCase, row: dict[str, Any], factor: float) -> PlantedCase:
    """Return the case with a multiple of the minimum detectable effect of a report's row."""
    strong = planted_effect((row["kind"], row["at"], row["wheelset"]), STRONG)
    value = row["value"] / factor if row["kind"] == "creep_saturation" else row["value"] * factor
    planted = replace(strong, parameters={**strong.parameters, **row.get("with", {}), row["parameter"]: value})
    name = f"{case.order.name} at {factor:g} times the floor"
    return DetectableCase("floor", (planted,), replace(case.order, effects=(planted,), name=name), factor)


@dataclass(frozen=True)
class DetectableCase(PlantedCase):
    """A case with a multiple of a minimum detectable effect."""

    factor: float = 1.0

    @property
    def text(self) -> str:
        return f"{super().text}, floor x {self.factor:g}"
