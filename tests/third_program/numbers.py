"""The numbers of a design file, for the vehicles of Exudyn."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from railui.vehicle.design_reader import load_design
from tests.third_program.bogie import Bogie
from tests.third_program.coach import Coach, Spring
from tests.third_program.contact import Wheels

DESIGNS = Path(__file__).parents[2] / "designs"
BOGIE, COACH = DESIGNS / "test_bogie.yaml", DESIGNS / "manchester_coach.yaml"
# no design has them, since nothing pitches in railui: usual numbers, which the lateral motion hardly feels
FRAME_PITCH, BODY_PITCH = 1476.0, 1.97e6


class Numbers:
    """Values of a design by their paths, some of them replaced."""

    def __init__(self, design: Path, true: Mapping[str, float]) -> None:
        self.design, self.true = load_design(design), true
        if unknown := sorted(set(true) - set(self.design.paths())):
            raise ValueError(f"{design}: no such paths: {', '.join(unknown)}")

    def __call__(self, path: str) -> float:
        return float(self.true.get(path, self.design.value(path)))

    def contact(self, group: str, wheelset: tuple[str, str, str, str], linear: bool) -> Wheels:
        """Contact of a wheelset; `wheelset` holds the paths of half gauge, radius, wheel load, spin inertia."""
        half_gauge, radius, load, spin = (self(path) for path in wheelset)
        names = ("conicity", "longitudinal_creep", "lateral_creep", "gravitational_stiffness", "contact_angle", "roll")
        own = {name: self(f"contact.{group}.{name}") for name in names}
        wheels = Wheels(half_gauge, radius, load, spin, spin_creep=self("contact.spin_creep"), **own)
        return wheels if linear else self._full(wheels)

    def _full(self, wheels: Wheels) -> Wheels:
        """The wheels with creep saturation and flange of the design's own effects."""
        known = {effect.kind: effect.parameters for effect in self.design.effects}
        values = vars(wheels) | {"friction": known["creep_saturation"]["friction"]}
        flange = known["flange_contact"]
        return Wheels(**values | {"clearance": flange["clearance"], "flange": flange["stiffness"]})


def bogie(true: Mapping[str, float] | None = None) -> Bogie:
    """The test bogie, with true values in place of the declared ones."""
    of = Numbers(BOGIE, true or {})
    geometry = "vehicle.geometry."
    wheelset = (geometry + "half_gauge", geometry + "rolling_radius", "vehicle.wheel_load")
    paths = (*wheelset, "vehicle.wheelset.spin_inertia")
    secondary = "vehicle.secondary."
    return Bogie(
        frame_mass=of("vehicle.frame.mass"),
        frame_inertia=of("vehicle.frame.yaw_inertia"),
        wheelset_mass=of("vehicle.wheelset.mass"),
        wheelset_inertia=of("vehicle.wheelset.yaw_inertia"),
        half_wheelbase=of(geometry + "half_wheelbase"),
        half_base=of(geometry + "half_spring_base"),
        longitudinal=of("vehicle.primary.longitudinal_stiffness"),
        lateral=of("vehicle.primary.lateral_stiffness"),
        secondary_lateral=(of(secondary + "lateral_stiffness"), of(secondary + "lateral_damping")),
        secondary_yaw=(of(secondary + "yaw_stiffness"), of(secondary + "yaw_damping")),
        wheels=(of.contact("leading", paths, True), of.contact("trailing", paths, True)),
    )


def coach(true: Mapping[str, float] | None = None, wheelset_roll_inertia: float | None = None) -> Coach:
    """The Manchester coach; the roll inertia of its wheelsets, which no design has, is that of their yaw where None."""
    of = Numbers(COACH, true or {})
    elements, bodies = "vehicle.elements.", "vehicle.bodies."
    wheelset = elements + "wheelset."
    names = ("half_gauge", "rolling_radius", "wheel_load", "spin_inertia")
    paths = (wheelset + names[0], wheelset + names[1], wheelset + names[2], wheelset + names[3])

    def solid(name: str, pitch: float) -> tuple[float, float, float, float, float]:
        at = f"{bodies}{name}."
        return of(at + "mass"), of(at + "roll_inertia"), pitch, of(at + "yaw_inertia"), of(at + "height")

    def spring(name: str, dampers: tuple[str, ...]) -> Spring:
        along = ("longitudinal", "lateral", "vertical")
        k_x, k_y, k_z = (of(f"{elements}{name}.{word}_stiffness") for word in along)
        c_x, c_y, c_z = (sum(of(f"{elements}{damper}.{word}_damping") for damper in dampers) for word in along)
        place = (of(f"{elements}{name}.{key}") for key in ("y", "height", "static_load"))
        return Spring((k_x, k_y, k_z), (c_x, c_y, c_z), *place)

    yaw = of(wheelset + "yaw_inertia")
    return Coach(
        body=solid("body", BODY_PITCH),
        frame=solid("frame", FRAME_PITCH),
        wheelset=(of(wheelset + "mass"), yaw if wheelset_roll_inertia is None else wheelset_roll_inertia, yaw),
        half_centres=of(bodies + "frame.half_centres"),
        half_wheelbase=of(wheelset + "half_wheelbase"),
        primary=spring("primary", ("primary_damper",)),
        secondary=spring("secondary", ("secondary_damper", "lateral_damper")),
        roll=of(elements + "anti_roll_bar.stiffness") + 2 * of(elements + "secondary.roll_stiffness"),
        stop=(of(elements + "bump_stop.gap"), of(elements + "bump_stop.stiffness")),
        wheels=of.contact("wheels", paths, False),
    )
