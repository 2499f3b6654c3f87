"""Parameter of a design: path, symbol, unit, default and range."""

from __future__ import annotations

import math
from dataclasses import dataclass

from railui.contact.profile_reader import read_inclination
from railui.io.number_format import format_quantity
from railui.io.units import UnitError, example_quantity, quantity

INFINITE = math.inf
MAX_PLAUSIBLE = 1e15  # beyond any number of a vehicle
# Beyond its usual range by such a factor a number is probably another one: kg for N are 9.8 times as many, a prefix is
# a factor of 1000; of half a length, or a radius, the whole is twice as much, and lengths of vehicles vary little.
UNUSUAL_FACTOR, UNUSUAL_LENGTH_FACTOR = 3.0, 1.2


@dataclass(frozen=True)
class Parameter:
    """Number of a design.

    Attributes
    ----------
    path : str
        Dotted path.
    symbol, unit, caption : str
        The unit is SI.
    default : float or None
        None if the key is required, unless `optional`.
    origin : str
        Origin of the default.
    minimum, maximum : float
        Range of a file; `exclusive_minimum` rejects the minimum itself.
    usual_range : (float, float)
        Range of real vehicles, for scales and searches.
    prior_sd : float or None
        Standard deviation of a prior about the nominal value, for parameters that sensors hardly determine.
    optional : bool
    example : str
        Value in the line that a remedy suggests; by default one of the unit, or of the middle of the usual range.
    """

    path: str
    symbol: str
    unit: str
    caption: str
    default: float | None = None
    origin: str = ""
    minimum: float = 0.0
    maximum: float = MAX_PLAUSIBLE
    exclusive_minimum: bool = False
    usual_range: tuple[float, float] = (0.0, INFINITE)
    prior_sd: float | None = None
    optional: bool = False
    example: str = ""

    @property
    def key(self) -> str:
        """Last part of the path."""
        return self.path.rpartition(".")[2]

    @property
    def whole(self) -> str:
        """Name of the length of which this is half; empty for other numbers.

        >>> Parameter("half_wheelbase", "a", "m", "half the wheelbase").whole
        'the wheelbase'
        """
        if self.caption.startswith("half "):
            return self.caption.removeprefix("half ").partition(",")[0]
        return "the diameter" if "rolling radius" in self.caption else ""

    def read(self, value: object) -> float:
        """Return a value in SI; UnitError if unit or range do not fit.

        >>> Parameter("contact.flange_clearance", "c", "m", "clearance").read("7 mm")
        0.007
        """
        return self.check_range(quantity(value, self.unit, self.usual_example.partition("  #")[0]), value)

    def check_range(self, number: float, value: object) -> float:
        """Return the number; UnitError if it is out of range."""
        if number < self.minimum or (self.exclusive_minimum and number == self.minimum):
            bound = "above" if self.exclusive_minimum else "at least"
            raise UnitError(
                f"{value} is too small for the {self.caption}",
                f"give {bound} {format_quantity(self.minimum, self.unit)}",
            )
        if number > self.maximum:
            raise UnitError(
                f"{value} is too large for the {self.caption}",
                f"give at most {format_quantity(self.maximum, self.unit)}",
            )
        return number

    @property
    def usual_example(self) -> str:
        """Example for remedies: the stated one, that of the unit, or where that is unusual the default or a mean.

        >>> Parameter("roller_radius", "R", "m", "radius of the rollers", usual_range=(0.1, 2.0)).usual_example
        '400 mm'
        """
        low, high = self.usual_range
        example = self.example or example_quantity(self.unit)
        if self.example or low <= quantity(example, self.unit) <= high:
            return example
        middle = math.sqrt(low * high) if low > 0.0 else 0.5 * high
        values = (self.default, float(f"{middle:.1g}"), middle)
        return format_quantity(next(x for x in values if x and low <= x <= high), self.unit)

    def sample(self) -> str:
        """Return an example line for remedies."""
        return f"{self.key}: {self.usual_example}"


def numbered_path(path: str, number: int) -> str:
    """Return the path of a number at one of several joints or wheelsets.

    >>> numbered_path("vehicle.elements.damper.lateral_damping", 2)
    'vehicle.elements.damper.lateral_damping.2'
    """
    return f"{path}.{number}"


def is_numbered(path: str) -> bool:
    """True for the path of a number at one of several joints or wheelsets."""
    return path.rpartition(".")[2].isdecimal()


def is_curve_point(path: str) -> bool:
    """True for the path of a point of a force curve.

    >>> is_curve_point("effects.0.force.3"), is_curve_point("effects.0.force")
    (True, False)
    """
    *_, key, number = path.split(".")
    return key == "force" and number.isdecimal()


def split_path(path: str) -> tuple[str, str]:
    """Split a path into its group and its key, which includes the number of a joint or wheelset.

    >>> split_path("contact.wheels.conicity"), split_path("contact.wheels.conicity.2")
    (('contact.wheels', 'conicity'), ('contact.wheels', 'conicity.2'))
    """
    group, _, key = path.rpartition(".")
    if not is_numbered(path):
        return group, key
    group, _, name = group.rpartition(".")
    return group, f"{name}.{key}"


class Inclination(Parameter):
    """Inclination of the rails, as 1:40 or an angle; without bounds, since YAML 1.1 takes 1:40 for a number.

    >>> round(Inclination("contact.profiles.inclination", "i", "rad", "inclination").read("1:40"), 6)
    0.024995
    """

    def read(self, value: object) -> float:
        """Return an inclination [rad]; UnitError if it is none."""
        return read_inclination(value)
