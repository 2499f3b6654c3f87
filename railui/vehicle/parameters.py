"""List of the parameters of bogies and rigs, and of their settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from railui.io.problems import suggest_name
from railui.io.units import UnitError
from railui.runs.columns import RIG_FORMS
from railui.vehicle.parameter import INFINITE, MAX_PLAUSIBLE, Inclination, Parameter


def _in_group(group: str, *entries: Parameter) -> tuple[Parameter, ...]:
    return tuple(replace(entry, path=f"{group}.{entry.path}") for entry in entries)


def _positive(key: str, symbol: str, unit: str, caption: str, low: float, high: float, example: str = "") -> Parameter:
    return Parameter(key, symbol, unit, caption, exclusive_minimum=True, usual_range=(low, high), example=example)


def _zero_by_default(key: str, symbol: str, unit: str, caption: str, most: float = INFINITE) -> Parameter:
    return Parameter(key, symbol, unit, caption, 0.0, "none where none is named", usual_range=(0.0, most))


CHECK = "check values of the model"
SPIN, GAUGE = "0 leaves the gyroscopic moments out", "standard gauge"
VEHICLE = (
    *_in_group(
        "vehicle.frame",
        _positive("mass", "m_b", "kg", "mass of the bogie frame", 500, 2e4),
        _positive("yaw_inertia", "I_zb", "kg*m^2", "yaw inertia of the bogie frame", 500, 4e4),
    ),
    *_in_group(
        "vehicle.wheelset",
        _positive("mass", "m_a", "kg", "mass of one wheelset", 500, 4e3, "1850 kg"),
        _positive("yaw_inertia", "I_za", "kg*m^2", "yaw inertia of one wheelset", 200, 3e3, "1050 kg*m^2"),
        Parameter("spin_inertia", "I_ya", "kg*m^2", "spin inertia of one wheelset", 0.0, SPIN, usual_range=(20, 400)),
    ),
    *_in_group(
        "vehicle.geometry",
        _positive("half_wheelbase", "a", "m", "half the wheelbase", 0.7, 2.0, "1.28 m"),
        Parameter(
            "half_gauge",
            "b",
            "m",
            "half the distance of the rolling circles",
            0.75,
            GAUGE,
            exclusive_minimum=True,
            usual_range=(0.5, 0.9),
        ),
        _positive("half_spring_base", "b_c", "m", "half the lateral distance of the primary springs", 0.4, 1.2, "1 m"),
        _positive("rolling_radius", "r", "m", "nominal rolling radius", 0.2, 0.7, "0.46 m"),
    ),
    _positive("vehicle.wheel_load", "N", "N", "load of one wheel on the rail", 1e4, 2e5),
    *_in_group(
        "vehicle.primary",
        Parameter("lateral_stiffness", "c_y", "N/m", "lateral stiffness per axle box", usual_range=(1e5, 1e8)),
        Parameter(
            "longitudinal_stiffness", "c_x", "N/m", "longitudinal stiffness per axle box", usual_range=(1e5, 1e8)
        ),
    ),
    *_in_group(
        "vehicle.secondary",
        _zero_by_default("lateral_stiffness", "c_sy", "N/m", "lateral stiffness bogie to carbody", 5e6),
        _zero_by_default("yaw_stiffness", "c_spsi", "N*m/rad", "yaw stiffness bogie to carbody", 5e6),
        _zero_by_default("lateral_damping", "k_y", "N*s/m", "lateral damping bogie to carbody", 3e5),
        _zero_by_default("yaw_damping", "k_psi", "N*m*s/rad", "yaw damping bogie to carbody", 5e6),
    ),
)
LONGITUDINAL = "longitudinal creep coefficient over wheel load"
LATERAL = "lateral creep coefficient over wheel load"
GRAVITY = "gravitational stiffness parameter"
ANGLE, ROLL = "mean contact angle", "roll of the wheelset per lateral displacement"
WHEELSET_CONTACT = (
    Parameter("conicity", "lambda", "1", "equivalent conicity", minimum=-2.0, maximum=5.0, usual_range=(0.0, 0.8)),
    Parameter("longitudinal_creep", "kappa_x", "1", LONGITUDINAL, usual_range=(20, 600), example="180"),
    Parameter("lateral_creep", "kappa_y", "1", LATERAL, usual_range=(20, 600), example="165"),
    Parameter(
        "gravitational_stiffness", "epsilon", "1", GRAVITY, None, "", -1e3, 1e4, usual_range=(0, 60), example="6"
    ),
    Parameter("contact_angle", "delta", "rad", ANGLE, 0.05, CHECK, -1.5, 1.5, usual_range=(0.0, 0.2), prior_sd=0.01),
    Parameter("roll", "sigma", "1", ROLL, 0.05, CHECK, -5.0, 5.0, usual_range=(0.0, 0.2), prior_sd=0.01),
)
SPIN_CREEP, CLEARANCE = "spin creep coefficient over wheel load", "clearance between flange and rail"
NEW_WHEELS = "7 mm, S1002 on 60E1 at a gauge of 1436 to 1437 mm"
CONTACT = (
    *(
        replace(
            p,
            path=f"contact.{where}.{p.path}",
            symbol=f"{p.symbol}_{i}",
            caption=f"{p.caption}, {where} wheelset",
        )
        for i, where in ((1, "leading"), (2, "trailing"))
        for p in WHEELSET_CONTACT
    ),
    *_in_group(
        "contact",
        Parameter(
            "spin_creep", "kappa_s", "m", SPIN_CREEP, 0.25, CHECK, maximum=100.0, usual_range=(0.0, 1.0), prior_sd=0.05
        ),
        Parameter("flange_clearance", "c", "m", CLEARANCE, 0.007, NEW_WHEELS, 0.0, 0.1, True, (0.002, 0.02)),
    ),
)
PROFILES = _in_group(
    "contact.profiles",
    Parameter("gauge", "G", "m", "track gauge, 14 mm below the top of the rails", 1.435, GAUGE, 0.0,
              exclusive_minimum=True, usual_range=(1.42, 1.46)),
    Parameter("back_to_back", "B", "m", "distance of the inner faces of the wheels", 1.36, GAUGE, 0.0,
              exclusive_minimum=True, usual_range=(1.355, 1.365)),
    Inclination("inclination", "i", "rad", "inclination of the rails, 1:40 or an angle", 0.0,
                "the file has it", -INFINITE, INFINITE, usual_range=(0.0, 0.05)),
    Parameter("diameter_difference", "D", "m", "right minus left wheel diameter", 0.0, "equal wheels", -0.1, 0.1,
              usual_range=(-2e-3, 2e-3)),
    Parameter("smoothing", "L", "m", "cut-off wavelength of the filter of the profiles", 0.0, "none", 0.0, 0.03,
              usual_range=(0.0, 0.01)),
    Parameter("sd", "s", "m", "standard deviation of e, over which the contact is linearised", 2e-3,
              "ordinary track", 2.5e-4, 0.01, usual_range=(5e-4, 5e-3)),
    Parameter("surface", "f", "1", "factor on Kalker's coefficients for the rail surface", 0.6,
              "Hobbs 1967: 0.5 to 0.7", 0.05, 1.5, usual_range=(0.4, 1.0)),
)  # fmt: skip
RIG_MASS = "95 kg  # of a rotor its moment of inertia, a number in kg*m^2"
RIG = _in_group(
    "vehicle.rig",
    _positive("mass", "m", "kg", "mass on the test bench", 0.0, INFINITE, RIG_MASS),
    _zero_by_default("stiffness", "k", "N/m", "stiffness of the linear spring"),
    _zero_by_default("damping", "c", "N*s/m", "damping of the linear damper"),
    Parameter(
        "gain",
        "gain",
        "1",
        "gain of the input",
        1.0,
        "the input as it is",
        -INFINITE,
        usual_range=(-INFINITE, INFINITE),
    ),
    Parameter(
        "preload",
        "F_0",
        "N",
        "steady force of the spring at z = 0",
        0.0,
        "none where none is named",
        -MAX_PLAUSIBLE,
        usual_range=(-INFINITE, INFINITE),
    ),
)
# a component whose motion is prescribed needs no mass and has no gain; its stiffness may be negative (snap-through)
BENCH = tuple(
    replace(p, minimum=-MAX_PLAUSIBLE) if p.key == "stiffness" else p for p in RIG if p.key not in ("mass", "gain")
)
FLOOR = "a carbody on its secondary suspension"
SHARE = "admissible share of time with flange contact"


def _optional(key: str, symbol: str, unit: str, caption: str, *usual: float, above: bool = True) -> Parameter:
    return Parameter(
        key, symbol, unit, caption, optional=True, exclusive_minimum=above, usual_range=(usual[0], usual[1])
    )


RIDING = _in_group(
    "riding",
    _optional("journey", "T_j", "s", "duration of the journey", 600, 43200),
    Parameter(
        "comfort_weight", "w", "1", "weight of comfort in the score", maximum=1.0, usual_range=(0, 1), optional=True
    ),
    Parameter(
        "admissible_flange_fraction", "phi_a", "1", SHARE, 0.05, "thesis chapter 2", 1e-6, 1.0, True, (1e-3, 0.2)
    ),
    Parameter(
        "floor_frequency",
        "f_0",
        "Hz",
        "lateral frequency of the floor",
        1.2,
        FLOOR,
        exclusive_minimum=True,
        usual_range=(0.3, 5),
    ),
    Parameter("floor_damping", "z", "1", "damping ratio of the floor", 0.2, FLOOR, usual_range=(0, 1)),
    _optional("cushion_frequency", "f_c", "Hz", "frequency of the seat cushion", 1, 20),
    _optional("cushion_damping", "z_c", "1", "damping ratio of the seat cushion", 0, 1, above=False),
    _optional("rms_limit", "a_rms", "m/s^2", "admissible rms acceleration of goods", 0.1, 10),
    _optional("peak_limit", "a_max", "m/s^2", "admissible peak acceleration of goods", 0.1, 50),
)

FORMS: dict[str, tuple[Parameter, ...]] = {"bogie": VEHICLE + CONTACT, "rig": RIG, "bench": BENCH}
PARAMETERS: dict[str, Parameter] = {p.path: p for p in VEHICLE + CONTACT + PROFILES + RIG + RIDING}
BENCH_PARAMETERS: dict[str, Parameter] = PARAMETERS | {p.path: p for p in BENCH}
# choices of words and switches; the first is the default
SETTINGS: dict[str, tuple[str | bool, ...]] = {
    "riding.use": ("long_distance", "local", "goods"),
    "riding.guidance": ("flange", "lateral_force"),
    "contact.gauge_widens_clearance": (False, True),
    "vehicle.rig.input": ("force", "base_displacement", "base_acceleration", "motion"),
}
# goods have no passengers: the journey does not limit their class; the comfort weight is that of local traffic
DEFAULTS_BY_USE = {
    "long_distance": {"riding.journey": 4 * 3600.0, "riding.comfort_weight": 0.6},
    "local": {"riding.journey": 3600.0, "riding.comfort_weight": 0.4},
    "goods": {"riding.journey": 0.0, "riding.comfort_weight": 0.4},
}
DEFAULT_ESTIMATED = {
    "bogie": ("contact.leading", "contact.trailing", "contact.spin_creep", "vehicle.primary",
              "vehicle.secondary.lateral_damping", "vehicle.secondary.yaw_damping"),
    "rig": ("vehicle.rig.stiffness", "vehicle.rig.damping", "vehicle.rig.gain"),
    "bench": ("vehicle.rig.stiffness", "vehicle.rig.damping", "vehicle.rig.preload"),
}  # fmt: skip


def default_estimated(form: str, rig_input: str) -> tuple[str, ...]:
    """Return the paths that a campaign estimates by default; a rig driven by a force has a preload as well.

    >>> default_estimated("rig", "force")[-1], default_estimated("rig", "base_displacement")[-1]
    ('vehicle.rig.preload', 'vehicle.rig.gain')
    """
    extra = ("vehicle.rig.preload",) if (form, rig_input) == ("rig", "force") else ()
    return DEFAULT_ESTIMATED[form] + extra


def setting_paths(form: str) -> tuple[str, ...]:
    """Return the paths of words, switches and riding numbers of a kind of vehicle."""
    if form in RIG_FORMS:
        return ("vehicle.rig.input",)
    return ("riding.use", "riding.guidance", "contact.gauge_widens_clearance", *(p.path for p in RIDING))


def parse_setting(path: str, value: Any) -> float | str | bool:
    """Return the value of a word, switch or riding number; UnitError if it does not fit."""
    if path in PARAMETERS:
        return PARAMETERS[path].read(value)
    choices = SETTINGS[path]
    if isinstance(choices[0], bool) and isinstance(value, str) and value in ("true", "false"):
        value = value == "true"
    if not any(value is choice or (isinstance(value, str) and value == choice) for choice in choices):
        words = [str(choice).lower() if isinstance(choice, bool) else choice for choice in choices]
        raise UnitError(f"{value!r} is not known here", suggest_name(str(value), map(str, words)))
    return value  # type: ignore[no-any-return]


def expand_path(path: str, known: list[str]) -> list[str]:
    """Return the path itself if it is known, else all paths of the group that it names.

    >>> expand_path("vehicle.primary", [p.path for p in VEHICLE])
    ['vehicle.primary.lateral_stiffness', 'vehicle.primary.longitudinal_stiffness']
    """
    return [path] if path in known else [p for p in known if p.startswith(f"{path}.")]


def nest(values: Mapping[str, Any]) -> dict[str, Any]:
    """Nest values by dotted path into groups.

    >>> nest({"vehicle.frame.mass": 1, "name": "a", "vehicle.wheel_load": 2})
    {'vehicle': {'frame': {'mass': 1}, 'wheel_load': 2}, 'name': 'a'}
    """
    root: dict[str, Any] = {}
    for path, value in values.items():
        *groups, key = path.split(".")
        here = root
        for group in groups:
            here = here.setdefault(group, {})
        here[key] = value
    return root
