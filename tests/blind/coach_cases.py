"""Random campaigns of a coach: effects at its joints by chance, sensors, noise, speeds and tracks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.blind.cases import STRONG, PlantedCase, interpolate, joint_of, suspension_parameters
from tests.blind.draw import NOISE
from tests.truth.coach_campaign import ALL, FLOOR, Order
from tests.truth.coach_joints import numbers_of
from tests.truth.effects import Effect

# rms motion z and velocity v of the nominal coach at 45 m/s on B176 low, at the joint with most; typical stiffness k
# and force F
TYPICAL_MOTION = {
    "primary_lateral": {"z": 4.4e-4, "v": 1.3e-2, "k": 7.8e6, "F": 2.7e3},
    "primary_yaw": {"z": 5e-5, "v": 1.2e-3, "k": 6.3e7, "F": 3.1e3},
    "secondary_lateral": {"z": 3.2e-3, "v": 3.3e-2, "k": 3.2e5, "F": 2e3},
    "secondary_yaw": {"z": 6.8e-4, "v": 1e-2, "k": 2e6, "F": 2e3},
    "anti_roll_bar_roll": {"z": 1.2e-3, "v": 1.5e-2, "k": 9.4e5, "F": 1.1e3},
}
# the two elements of a secondary suspension are one joint; the laws of dampers are reported at the damper
TYPICAL_MOTION["lateral_damper_lateral"] = TYPICAL_MOTION["secondary_lateral"]
SPRINGS = ("primary_lateral", "primary_yaw", "secondary_lateral", "anti_roll_bar_roll")
WEAKEST = -1.0  # size of the weakest single effects: far below weak
COUNTS = {"single": 10, "nothing": 5, "outside": 5, "floor": 5, "two": 5}
# responses that are recorded
SENSOR_SETS: dict[str, tuple[str, ...]] = {
    "all": ALL,
    "no rail position": tuple(x for x in ALL if not x.startswith("e")),
    "accelerometers and gyros": tuple(x for x in ALL if x[0] not in "ed"),
    "no accelerometers": tuple(x for x in ALL if not x.startswith("ay") and x not in FLOOR),
}
FLOOR_SENSORS = ("ay_front", "ay_rear", *FLOOR)
PRIOR_SPREAD = {"delta": 0.42, "kappa_s": 0.35}  # as wide as the priors that hold them
SPEEDS, SLOWER = (36.0, 52.0), (0.7, 0.85)  # m/s of the estimation run; the validation run's over it
ROUGHNESS = {"low": 1.0, "high": 1.65}  # rms motion on B176 over that on B176 low
Entry = tuple[str, str, int | None]
Stranger = tuple[str, str, dict[str, float]]


@dataclass(frozen=True)
class CoachCase(PlantedCase):
    """A case of the coach; its order is that of `tests.truth.coach_campaign`."""

    order: Order  # type: ignore[assignment]

    @property
    def nuisance(self) -> str:
        """Disturbance that the campaign file does not state, or states wrongly."""
        order = self.order
        known = {"1/f": order.pink, "unmeasured": order.unmeasured, "unstated": order.stated == 0.0}
        known["wrong"] = order.stated not in (0.0, 1.0)
        return " ".join(name for name, is_so in known.items() if is_so)

    @property
    def sensors(self) -> str:
        """Name of the set of recorded responses."""
        sets = {**SENSOR_SETS, "frames and floor": FLOOR_SENSORS}
        return next((name for name, channels in sets.items() if channels == self.order.channels), "other")


def library_entries() -> list[Entry]:
    """List kind, location and joint of every effect that the generator has and the estimated parameters do not absorb.

    No friction or damper at the yaw of an axle box: it is so stiff that the generator needs hundreds of steps per
    sample. No clearance at the secondary yaw, whose spring gives hardly any of the moment there.
    """
    entries: list[Entry] = []
    for kind in ("free_play", "cubic_stiffness", "quadratic_stiffness", "bump_stop"):
        entries += [(kind, at, n) for at in SPRINGS for n in (None, *numbers_of(at))]
    for kind in ("dry_friction", "hysteresis"):
        at_joints = ("primary_lateral", "secondary_lateral", "secondary_yaw", "anti_roll_bar_roll")
        entries += [(kind, at, n) for at in at_joints for n in (None, *numbers_of(at))]
    for kind in ("maxwell_damper", "quadratic_damper"):
        at_joints = ("primary_lateral", "lateral_damper_lateral", "secondary_yaw")
        entries += [(kind, at, n) for at in at_joints for n in (None, *numbers_of(at))]
    entries += [("asymmetric_damper", "lateral_damper_lateral", n) for n in (None, 1, 2)]
    entries += [("viscous_damper", "primary_lateral", n) for n in (None, 1, 2, 3, 4)]
    entries += [("viscous_damper", "secondary_yaw", n) for n in (None, 1, 2)]
    entries += [("spring", at, n) for at in ("primary_lateral", "primary_yaw") for n in (1, 2, 3, 4)]
    entries += [("spring", at, n) for at in ("secondary_lateral", "anti_roll_bar_roll") for n in (None, 1, 2)]
    return entries + [("nonlinear_conicity", "contact", n) for n in (None, 1, 2, 3, 4)]


# faults that are not in the library; the joint is drawn
NOT_IN_LIBRARY: tuple[Stranger, ...] = (
    ("frame_rumble", "frame", {"force": 1500.0}),
    ("frame_rumble", "body", {"force": 3000.0}),
    ("hung_mass", "frame", {"mass": 800.0, "stiffness": 8e5, "damping": 2e3}),
    ("ageing_friction", "primary_lateral", {"force": 1500.0, "slip_speed": 5e-3, "rise": 3.0}),
    ("ageing_friction", "secondary_lateral", {"force": 1500.0, "slip_speed": 1e-2, "rise": 3.0}),
    ("switching_damper", "secondary_lateral", {"damping": 4e4}),
    ("fading_damper", "secondary_lateral", {"damping": 1.2e5, "energy": 60.0}),
    ("primary_drift", "primary_lateral", {"share": -0.6}),
)


def planted_effect(entry: Entry, size: float, rough: float = 1.0) -> Effect:
    """Create the effect of a library entry, of a size relative to the motion on a track so many times as rough."""
    kind, at, number = entry
    if kind == "nonlinear_conicity":
        return Effect(kind, at, number, {"cubic": interpolate(3e4, 1e5, size) / rough**2})
    motion = {name: x * (1.0 if name == "k" else rough) for name, x in TYPICAL_MOTION[at].items()}
    return Effect(kind, at, number, suspension_parameters(kind, motion, size))


def draw_coaches(seed: int, seconds: Sequence[float]) -> list[CoachCase]:
    """Draw the campaigns of a trial in random order."""
    rng = np.random.default_rng([seed, 53])
    sorts = [sort for sort, n in COUNTS.items() for _ in range(n)]
    strangers = [NOT_IN_LIBRARY[k] for k in rng.permutation(len(NOT_IN_LIBRARY))]
    cases = []
    for i, k in enumerate(rng.permutation(len(sorts))):
        order = _order(rng, seed + i, sorts[k], seconds)
        stranger = strangers.pop() if sorts[k] == "outside" else strangers[0]
        effects = _effects(rng, sorts[k], stranger, ROUGHNESS[order.track])
        sort = {"single": "catalogue", "floor": "catalogue"}.get(sorts[k], sorts[k])
        cases.append(CoachCase(sort, effects, replace(order, effects=effects)))
    return cases


def _effects(rng: np.random.Generator, sort: str, stranger: Stranger, rough: float) -> tuple[Effect, ...]:
    entries = library_entries()
    if sort == "nothing":
        return ()
    if sort == "outside":
        kind, at, numbers = stranger
        joints = (None, *numbers_of(at)) if at != "body" else (None,)
        return (Effect(kind, at, joints[int(rng.integers(len(joints)))], numbers),)
    if sort == "two":
        while True:
            first, second = (entries[int(k)] for k in rng.choice(len(entries), 2, replace=False))
            if first[0] != second[0] and joint_of(first[1]) != joint_of(second[1]):
                return planted_effect(first, STRONG, rough), planted_effect(second, STRONG, rough)
    # kinds alike in chance, then their joints: some have many
    kinds = sorted({kind for kind, _, _ in entries})
    kind = kinds[int(rng.integers(len(kinds)))]
    own = [e for e in entries if e[0] == kind]
    return (planted_effect(own[int(rng.integers(len(own)))], float(rng.uniform(WEAKEST, STRONG)), rough),)


def _order(rng: np.random.Generator, seed: int, sort: str, seconds: Sequence[float]) -> Order:
    """Draw vehicle, track, speeds, sensors and noise of a campaign."""
    shares = np.array([share for share, _ in NOISE])
    options: dict[str, Any] = NOISE[int(rng.choice(len(NOISE), p=shares / shares.sum()))][1]
    sets = list(SENSOR_SETS.values())
    speed = float(rng.uniform(*SPEEDS))
    channels = sets[int(rng.integers(len(sets)))]
    return Order(
        seed,
        name=f"coach {seed}",
        channels=FLOOR_SENSORS if sort == "floor" else channels,
        speeds=(speed, speed * float(rng.uniform(*SLOWER))),
        seconds=(float(seconds[0]), float(seconds[1])),
        track=("low", "high")[int(rng.integers(2))],
        noise=2.0 ** float(rng.uniform(-1.0, 1.0)),
        spread=PRIOR_SPREAD,
        **options,
    )
