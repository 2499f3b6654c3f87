"""Numbers on the command line: speeds with or without a unit, ranges, lists of seeds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

MOST = 10_000  # values of a range
MOST_CANT = 0.5  # m
PARTS = 20  # of a range that names no step


def inclusive(first: float, last: float, step: float | None = None) -> list[float]:
    """The values of a range, its ends included; without a step a twentieth of it.

    >>> inclusive(5.0, 90.0, 5.0)[-1], len(inclusive(0.0, 1.0)), inclusive(30.0, 62.0, 10.0)
    (90.0, 21, [30.0, 40.0, 50.0, 60.0])
    """
    if last < first:
        raise ValueError(f"the range {first:g}:{last:g} runs backwards, write {last:g}:{first:g}")
    step = (last - first) / PARTS if step is None else step
    if last > first and not step > 0:
        raise ValueError(f"the step of a range must be positive: {step:g}")
    count = 1 if last == first else int((last - first) / step + 1e-9) + 1
    if count > MOST:
        raise ValueError(f"the range has {count} values, {MOST} are the most: take a larger step")
    return [first + i * step for i in range(count)]


def speeds(text: str) -> list[float]:
    """Speeds [m/s]: single ones and ranges, divided by commas; the unit behind a range goes for all of it.

    Raises ValueError; a bare number above 120 is one, since km/h may be meant.

    >>> speeds("30:60:10"), speeds("144 km/h"), speeds("90:180:90 km/h")
    ([30.0, 40.0, 50.0, 60.0], [40.0], [25.0, 50.0])
    """
    from railui.io.units import quantity, read_speed, split

    found: list[float] = []
    for part in text.split(","):
        ends = [end.strip() for end in part.split(":")]
        if not 1 <= len(ends) <= 3:
            raise ValueError(f"{part.strip()!r} is no range: write FIRST:LAST or FIRST:LAST:STEP")
        unit = split(ends[-1])[1]
        ends = [end if split(end)[1] or not unit else f"{end} {unit}" for end in ends]
        first, last = read_speed(ends[0]), read_speed(ends[min(1, len(ends) - 1)])
        step = quantity(ends[2], "m/s") if len(ends) == 3 else None
        found += [first] if len(ends) == 1 else inclusive(first, last, step)
    return found


def seeds(text: str) -> list[int]:
    """Seeds: whole numbers and ranges of them, divided by commas.

    >>> seeds("1,2,3"), seeds("4:7"), seeds("0:10:5")
    ([1, 2, 3], [4, 5, 6, 7], [0, 5, 10])
    """
    found: list[int] = []
    for part in text.split(","):
        ends = [end.strip() for end in part.split(":")]
        if not all(end.isdecimal() for end in ends) or len(ends) > 3:
            raise ValueError(f"{part.strip()!r} is no seed: write whole numbers, such as 1,2,3 or 1:10")
        numbers = [int(end) for end in ends]
        if len(numbers) == 1:
            found += numbers
        else:
            step = numbers[2] if len(numbers) == 3 else 1
            found += [round(x) for x in inclusive(numbers[0], numbers[1], step)]
    return found


def speed(text: str) -> float:
    """One speed [m/s], see `speeds`."""
    found = speeds(text)
    if len(found) != 1:
        raise ValueError(f"{text!r} is more than one speed: write 40.5 with a point, or give several to --speeds")
    return found[0]


def figure(text: str) -> str:
    """The name of a figure to draw, where it can be written.

    >>> figure("a.svg")
    'a.svg'
    """
    from railui.io.atomic import check_file

    if not text.lower().endswith((".svg", ".png", ".pdf")):
        raise ValueError(f"{text!r} is no figure: write a name that ends in .svg, .png or .pdf")
    check_file(text)
    return text


def length(text: str) -> float:
    """One length [m], with a unit or without.

    >>> length("100 mm")
    0.1
    """
    from railui.io.units import quantity

    return quantity(text, "m")


def cant(text: str) -> float:
    """A cant deficiency or excess [m]; a bare number above 0.5 raises ValueError, since mm may be meant.

    >>> cant("0.1"), cant("100 mm")
    (0.1, 0.1)
    """
    found = length(text)
    if abs(found) > MOST_CANT:
        hint = "write a smaller one" if text.strip()[-1:].isalpha() else f"were mm meant? write '{text.strip()} mm'"
        raise ValueError(f"{found:g} m is more than any curve has, {hint}")
    return found


def force(text: str) -> float:
    """One force [N], with a unit or without.

    >>> force("55 kN")
    55000.0
    """
    from railui.io.units import quantity

    return quantity(text, "N")


def stretch(text: str) -> float:
    """The length of a stretch of track [m], above 0."""
    found = length(text)
    if not found > 0:
        raise ValueError(f"{text!r} is no stretch of track: give a length above 0 m")
    return found


def reading(read: Callable[[str], Any]) -> Callable[[click.Context, click.Parameter, str | None], Any]:
    """A callback of an option that reads its text; a ValueError becomes wrong use of that option."""

    def callback(ctx: click.Context, parameter: click.Parameter, value: str | None) -> Any:
        if value is None:
            return None
        try:
            return read(value)
        except ValueError as error:
            raise click.BadParameter(str(error), ctx, parameter) from None

    return callback
