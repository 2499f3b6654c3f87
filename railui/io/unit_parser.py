"""Units: their symbols, and the parser of products, quotients and powers of them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache

# Base labels. Radian and cycle are dimensionless but distinct: 1 Hz is not 1 rad/s.
BASE_LABELS = ("m", "kg", "s", "A", "rad", "cycle")
ANGLE_INDICES = (BASE_LABELS.index("rad"), BASE_LABELS.index("cycle"))
Dimension = tuple[int, ...]

PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "da": 1e1,
            "k": 1e3, "M": 1e6, "G": 1e9}  # fmt: skip

# symbol: factor to SI, powers of the base labels, True if it takes prefixes
SYMBOLS: dict[str, tuple[float, dict[str, int], bool]] = {
    "m": (1.0, {"m": 1}, True),
    "g": (1e-3, {"kg": 1}, True),
    "t": (1e3, {"kg": 1}, False),
    "s": (1.0, {"s": 1}, True),
    "min": (60.0, {"s": 1}, False),
    "h": (3600.0, {"s": 1}, False),
    "A": (1.0, {"A": 1}, True),
    "V": (1.0, {"m": 2, "kg": 1, "s": -3, "A": -1}, True),
    "N": (1.0, {"m": 1, "kg": 1, "s": -2}, True),
    "J": (1.0, {"m": 2, "kg": 1, "s": -2}, True),
    "W": (1.0, {"m": 2, "kg": 1, "s": -3}, True),
    "Pa": (1.0, {"m": -1, "kg": 1, "s": -2}, True),
    "bar": (1e5, {"m": -1, "kg": 1, "s": -2}, True),
    "Hz": (1.0, {"cycle": 1, "s": -1}, True),
    "rev": (1.0, {"cycle": 1}, False),
    "rpm": (1.0 / 60.0, {"cycle": 1, "s": -1}, False),
    "rad": (1.0, {"rad": 1}, True),
    "deg": (math.pi / 180.0, {"rad": 1}, False),
    "°": (math.pi / 180.0, {"rad": 1}, False),
    "%": (1e-2, {}, False),
    "‰": (1e-3, {}, False),
}
RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"
SUPERSCRIPT = re.compile(f"[{RAISED}]+")
PLAIN = str.maketrans(RAISED + "·⋅×", "0123456789-***")
PLAIN_POWER = re.compile(r"(?<=[^\W\d_])(-?\d)(?![\d.])")  # the 2 of m/s2, the -2 of m s-2
TOKEN = re.compile(r"\^\(?[-+]?\d+\)?|[*/()]|1(?![\d.])|[^\W\d_]+|[%‰°]|\S")


class UnitError(ValueError):
    """Unreadable quantity, with message and remedy."""

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(f"{message}, {remedy}")
        self.message, self.remedy = message, remedy


@dataclass(frozen=True)
class Unit:
    """Unit: factor to SI and the powers of m, kg, s, A, rad, cycle."""

    text: str
    factor: float
    dimension: Dimension

    def is_compatible(self, other: Unit) -> bool:
        """True for the same dimension; an angle may be omitted, but not replaced by a cycle."""
        plain = all(
            a == b
            for i, (a, b) in enumerate(zip(self.dimension, other.dimension, strict=True))
            if i not in ANGLE_INDICES
        )
        angles = [(self.dimension[i], other.dimension[i]) for i in ANGLE_INDICES]
        left_out = all(a == 0 for a, _ in angles)
        return plain and (left_out or all(a == b for a, b in angles))


class _UnitParser:
    """Recursive-descent parser of products, quotients, powers and brackets."""

    def __init__(self, text: str) -> None:
        self.text = text
        plain = SUPERSCRIPT.sub(lambda match: f"^{match[0]}", text).replace("**", "^").translate(PLAIN)
        plain = PLAIN_POWER.sub(r"^\1", plain)
        self.tokens = TOKEN.findall(plain)
        self.factor, self.powers = 1.0, dict.fromkeys(BASE_LABELS, 0)

    def parse(self) -> Unit:
        self.read_product(1)
        if self.tokens:
            raise self.error()
        return Unit(self.text, self.factor, tuple(self.powers[name] for name in BASE_LABELS))

    def read_product(self, sign: int) -> None:
        self.read_factor(-sign if self.take("/") else sign)
        while self.tokens and self.tokens[0] != ")":
            over = self.take("/")
            if not over:
                self.take("*")
            self.read_factor(-sign if over else sign)

    def read_factor(self, sign: int) -> None:
        if self.take("("):
            self.read_product(sign)
            if not self.take(")"):
                raise self.error("lacks a closing bracket")
        elif not self.take("1"):
            if not self.tokens or not re.match(r"[^\W\d_]|[%‰°]", self.tokens[0]):
                raise self.error()
            factor, powers = parse_symbol(self.tokens.pop(0))
            power = sign * self.read_power()
            self.factor *= factor**power
            for name, p in powers.items():
                self.powers[name] += p * power

    def read_power(self) -> int:
        if not self.tokens or not self.tokens[0].startswith("^") or self.tokens[0] == "^":
            return 1
        power = int(self.tokens.pop(0).strip("^()"))
        if abs(power) > 9:
            raise self.error("has a power beyond 9")
        return power

    def take(self, token: str) -> bool:
        is_next = bool(self.tokens) and self.tokens[0] == token
        if is_next:
            self.tokens.pop(0)
        return is_next

    def error(self, what: str = "") -> UnitError:
        where = f"cannot be read at {self.tokens[0]!r}" if self.tokens else "ends too early"
        return UnitError(f"the unit {self.text!r} {what or where}", "write units like kN*s/m, m/s^2, 1/m")


def parse_symbol(symbol: str) -> tuple[float, dict[str, int]]:
    """Return factor and powers of a symbol with its prefix; UnitError if it is unknown."""
    if symbol in SYMBOLS:
        factor, powers, _ = SYMBOLS[symbol]
        return factor, powers
    for prefix, scale in PREFIXES.items():
        bare = symbol.removeprefix(prefix)
        if bare != symbol and bare in SYMBOLS and SYMBOLS[bare][2]:
            factor, powers, _ = SYMBOLS[bare]
            return (1.0 if symbol == "kg" else scale * factor), powers
    raise UnitError(f"unknown unit {symbol!r}", f"known are {', '.join(SYMBOLS)} with prefixes n u m c d da k M G")


@lru_cache(maxsize=512)
def parse_unit(text: str) -> Unit:
    """Parse a unit; UnitError if it cannot be read.

    >>> parse_unit("kN*s/m").factor
    1000.0
    >>> [parse_unit(text).dimension for text in ("m/s^2", "m/s2", "m/s²", "m s-2")] == 4 * [(1, 0, -2, 0, 0, 0)]
    True
    """
    if len(text) > 60:
        raise UnitError(f"the unit {text[:20]!r}... is {len(text)} characters long", "write units like kN*s/m")
    return _UnitParser(text).parse()
