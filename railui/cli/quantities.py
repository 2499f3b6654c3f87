"""Quantities on the command line: values with or without a unit, ranges, lists of seeds."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import click

MAX_RANGE_LENGTH = 10_000  # values
MAX_CANT = 0.5  # m
MIN_DURATION, MAX_DURATION = 20.0, 3600.0  # s, of a planned run
MIN_CURVE_RADIUS, MAX_CURVE_RADIUS = 10.0, 1e6  # m
DEFAULT_INTERVALS = 20  # of a range without a step
HINTED_INTERVALS = 6  # of the range that an error suggests
HYPHENATED_RANGE = re.compile(r"\s*(\d*\.?\d+)\s*[-\u2013]\s*(\d*\.?\d+)\s*([^\d:]*)")  # 30-60 km/h


def inclusive_range(first: float, last: float, step: float | None = None) -> list[float]:
    """Return the values of a range including its ends; the default step is a twentieth of the range.

    >>> inclusive_range(5.0, 90.0, 5.0)[-1], len(inclusive_range(0.0, 1.0)), inclusive_range(30.0, 62.0, 10.0)
    (90.0, 21, [30.0, 40.0, 50.0, 60.0])
    """
    if last < first:
        raise ValueError(f"the range {first:g}:{last:g} runs backwards, write {last:g}:{first:g}")
    step = (last - first) / DEFAULT_INTERVALS if step is None else step
    if last > first and not step > 0:
        raise ValueError(f"the step of a range must be positive: {step:g}")
    count = 1 if last == first else int((last - first) / step + 1e-9) + 1
    if count > MAX_RANGE_LENGTH:
        raise ValueError(f"the range has {count} values, at most {MAX_RANGE_LENGTH} are allowed: use a larger step")
    return [first + i * step for i in range(count)]


def parse_speeds(text: str) -> list[float]:
    """Parse speeds [m/s]: values and ranges separated by commas; the unit after a range applies to all of it.

    Raises ValueError, also for a bare number above 120, since km/h may be meant.

    >>> parse_speeds("30:60:10"), parse_speeds("144 km/h"), parse_speeds("90:180:90 km/h")
    ([30.0, 40.0, 50.0, 60.0], [40.0], [25.0, 50.0])
    """
    from railui.io.units import quantity, read_speed, split_quantity

    speeds: list[float] = []
    for part in text.split(","):
        ends = _split_range(part)
        unit = split_quantity(ends[-1])[1]
        ends = [end if split_quantity(end)[1] or not unit else f"{end} {unit}" for end in ends]
        first, last = read_speed(ends[0]), read_speed(ends[min(1, len(ends) - 1)])
        step = quantity(ends[2], "m/s") if len(ends) == 3 else None
        speeds += [first] if len(ends) == 1 else inclusive_range(first, last, step)
    return speeds


def parse_radius(text: str) -> float:
    """Parse the radius of a curve [m], negative to the left; ValueError for one that no track has.

    >>> parse_radius("-600 m")
    -600.0
    """
    radius = parse_length(text)
    if not MIN_CURVE_RADIUS <= abs(radius) <= MAX_CURVE_RADIUS:
        limits = f"{MIN_CURVE_RADIUS:g} to {MAX_CURVE_RADIUS:g} m"
        raise ValueError(f"{text!r} is not the radius of a curve: give {limits}, negative to the left")
    return radius


def parse_radii(text: str) -> list[float]:
    """Parse radii [m]: values and ranges separated by commas.

    >>> parse_radii("600, 250:750:250")
    [600.0, 250.0, 500.0, 750.0]
    """
    radii: list[float] = []
    for part in text.split(","):
        words = _split_range(part)
        ends = [parse_radius(end) for end in words[:2]] + [parse_length(end) for end in words[2:]]
        radii += [ends[0]] if len(ends) == 1 else inclusive_range(*ends)
    return radii


def parse_seeds(text: str) -> list[int]:
    """Parse seeds: whole numbers and ranges of them, separated by commas.

    >>> parse_seeds("1,2,3"), parse_seeds("4:7"), parse_seeds("0:10:5")
    ([1, 2, 3], [4, 5, 6, 7], [0, 5, 10])
    """
    seeds: list[int] = []
    for part in text.split(","):
        ends = [end.strip() for end in part.split(":")]
        if not all(end.isdecimal() for end in ends) or len(ends) > 3:
            raise ValueError(f"{part.strip()!r} is not a seed: write whole numbers, such as 1,2,3 or 1:10")
        numbers = [int(end) for end in ends]
        if len(numbers) == 1:
            seeds += numbers
        else:
            step = numbers[2] if len(numbers) == 3 else 1
            seeds += [round(x) for x in inclusive_range(numbers[0], numbers[1], step)]
    return seeds


def parse_speed(text: str) -> float:
    """Parse one speed [m/s], see `parse_speeds`."""
    speeds = parse_speeds(text)
    if len(speeds) != 1:
        raise ValueError(f"{text!r} is more than one speed: write 40.5 with a point, or give several to --speeds")
    return speeds[0]


def parse_frequencies(text: str) -> list[float]:
    """Parse frequencies [Hz] above 0: values and ranges separated by commas.

    >>> parse_frequencies("1:3:0.5"), parse_frequencies("0.5, 2 Hz")
    ([1.0, 1.5, 2.0, 2.5, 3.0], [0.5, 2.0])
    """
    from railui.io.units import quantity

    frequencies: list[float] = []
    for part in text.split(","):
        ends = [quantity(end, "Hz") for end in _split_range(part)]
        frequencies += [ends[0]] if len(ends) == 1 else inclusive_range(*ends)
    if not all(f > 0 for f in frequencies):
        raise ValueError(f"{text!r} has a frequency that is not above 0 Hz")
    return frequencies


def parse_names(text: str) -> list[str]:
    """Parse names separated by commas, each once.

    >>> parse_names("e1, ayf,e1")
    ['e1', 'ayf']
    """
    names = list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise ValueError("the list is empty: write names separated by commas")
    return names


def parse_length(text: str) -> float:
    """Parse a length [m], with or without a unit.

    >>> parse_length("100 mm")
    0.1
    """
    from railui.io.units import quantity

    return quantity(text, "m")


def parse_segment_length(text: str) -> float:
    """Parse the length of a track section [m], above 0."""
    length = parse_length(text)
    if not length > 0:
        raise ValueError(f"{text!r} is not the length of a track section: give more than 0 m")
    return length


def parse_budget(text: str) -> float:
    """Parse a time budget [s], above 0, with or without a unit.

    >>> parse_budget("2 min")
    120.0
    """
    from railui.io.units import quantity

    budget = quantity(text, "s")
    if not budget > 0:
        raise ValueError(f"{text!r} is no time budget: give more than 0 s")
    return budget


def parse_duration(text: str) -> float:
    """Parse the duration of a planned run [s]; ValueError for one too short to estimate from, or above an hour.

    >>> parse_duration("60 s"), parse_duration("2 min")
    (60.0, 120.0)
    """
    from railui.io.units import quantity

    seconds = quantity(text, "s")
    if not MIN_DURATION <= seconds <= MAX_DURATION:
        raise ValueError(f"{text!r} is no duration of a run: give {MIN_DURATION:g} to {MAX_DURATION:g} s")
    return seconds


def parse_cant(text: str) -> float:
    """Parse a cant deficiency or excess [m]; ValueError for a bare number above 0.5, since mm may be meant.

    >>> parse_cant("0.1"), parse_cant("100 mm")
    (0.1, 0.1)
    """
    cant = parse_length(text)
    if abs(cant) > MAX_CANT:
        remedy = "write a smaller one" if text.strip()[-1:].isalpha() else f"were mm meant? write '{text.strip()} mm'"
        raise ValueError(f"{cant:g} m is above the largest accepted cant of {MAX_CANT:g} m, {remedy}")
    return cant


def bounded(parse: Callable[[str], float], low: float, high: float, unit: str) -> Callable[[str], float]:
    """Return a parser that raises ValueError for values [SI] outside a range.

    >>> bounded(parse_length, 0.05, 1.5, "m")("460 mm")
    0.46
    """

    def parse_bounded(text: str) -> float:
        value = parse(text)
        if not low <= value <= high:
            raise ValueError(f"{text!r} is out of range: give {low:g} to {high:g} {unit}, or write its unit")
        return value

    return parse_bounded


def parse_force(text: str) -> float:
    """Parse a force [N], with or without a unit.

    >>> parse_force("55 kN")
    55000.0
    """
    from railui.io.units import quantity

    return quantity(text, "N")


def parse_figure_path(text: str) -> str:
    """Return the path of a figure to draw, where it can be written.

    >>> parse_figure_path("a.svg")
    'a.svg'
    """
    return _output_path(text, (".svg", ".png", ".pdf"), "a figure")


def parse_drawing_path(text: str) -> str:
    """Return the path of a schematic to draw, where it can be written.

    >>> parse_drawing_path("coach.svg")
    'coach.svg'
    """
    return _output_path(text, (".svg",), "a schematic")


def parse_plot_path(text: str) -> str:
    """Return the path of a figure or of a page with figures, where it can be written.

    >>> parse_plot_path("a.html")
    'a.html'
    """
    return _output_path(text, (".html", ".svg", ".png", ".pdf"), "a figure or a page")


def parse_series_path(text: str) -> str:
    """Return the path of a file of time series, where it can be written.

    >>> parse_series_path("run.csv.gz")
    'run.csv.gz'
    """
    from railui.io.series_file import check_series_file

    check_series_file(text)
    return text


def _output_path(text: str, suffixes: tuple[str, ...], what: str) -> str:
    from railui.io.atomic import check_file_writable

    if not text.lower().endswith(suffixes):
        names = " or ".join(filter(None, (", ".join(suffixes[:-1]), suffixes[-1])))
        raise ValueError(f"{text!r} is not the file of {what}: write a name that ends in {names}")
    check_file_writable(text)
    return text


def option_callback(parse: Callable[[str], Any]) -> Callable[[click.Context, click.Parameter, str | None], Any]:
    """Return a click callback that parses the text of an option; a ValueError becomes a usage error."""

    def callback(ctx: click.Context, parameter: click.Parameter, value: str | None) -> Any:
        if value is None:
            return None
        try:
            return parse(value)
        except ValueError as error:
            raise click.BadParameter(str(error), ctx, parameter) from None

    return callback


def _split_range(text: str) -> list[str]:
    """Split FIRST:LAST:STEP into its one to three parts."""
    ends = [end.strip() for end in text.split(":")]
    if match := HYPHENATED_RANGE.fullmatch(text):
        first, last = sorted((float(match[1]), float(match[2])))
        step = f"{(last - first) / HINTED_INTERVALS:.1g}"
        remedy = f"write {first:g}:{last:g}:{float(step):g} {match[3]}".rstrip()
        raise ValueError(f"{text.strip()!r} is not a range: {remedy}")
    if len(ends) > 3:
        raise ValueError(f"{text.strip()!r} is not a range: write FIRST:LAST or FIRST:LAST:STEP")
    return ends
