"""Write the table and the picture of docs/blind.md from the tables of docs/blind_trials.md: python docs/blind_summary.py."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from railui.report.figures.drawing import BLUE, figure_file

DOCS = Path(__file__).parent
ROW = re.compile(r"^\| (.+?) \| (\d+) of (\d+) \| (\d+) \| (\d+) to (\d+) \|$", re.M)
BEGIN, END = "<!-- summary -->", "<!-- end of summary -->"
# outcome as the trials name it, its name here, and what an ideal program would have [%]
BOGIE = (
    ("one effect planted: right name, class and location", "one effect: named, at its location", 100),
    ("two effects planted: all names", "two effects: both named", 100),
    ("three effects planted: all names", "three effects: all named", 100),
    ("no effect planted: false alarm", "no effect: false alarm", 0),
    ("outside the library: verdict `outside`", "outside the library: said so", 100),
    ("outside the library: its location, of those with the verdict `outside`", "of these: right location", 100),
    ("outside the library: an effect of the library named instead", "outside the library: wrong effect named", 0),
    (
        "detected at the minimum detectable effect (nominal power 90 %)",
        "effect of the minimum detectable size: found",
        90,
    ),
    ("90 % intervals with the true value: all parameters", "90 % intervals that contain the true value", 90),
    ("data fault diagnosed in sound data", "data fault diagnosed in sound data", 0),
)
COACH = (
    ("one effect planted: right name and joint group", "coach, one effect: named, at its joints", 100),
    ("two effects planted: both names and joint groups right", "coach, two effects: both named", 100),
    ("no effect planted: false alarm", "coach, no effect: false alarm", 0),
)


class Outcome(NamedTuple):
    """Count of an outcome, its percentage and 95 % limits, and the ideal percentage."""

    name: str
    hits: int
    trials: int
    percent: int
    low: int
    high: int
    ideal: int


def outcomes(text: str, names: Sequence[tuple[str, str, int]]) -> list[Outcome]:
    """Return the named rows of a table; ValueError where one is missing."""
    found = {name: tuple(map(int, numbers)) for name, *numbers in ROW.findall(text)}
    missing = [row for row, _, _ in names if row not in found]
    if missing:
        raise ValueError(f"docs/blind_trials.md has no row {missing}")
    return [Outcome(name, *found[row], ideal) for row, name, ideal in names]


def summary() -> list[Outcome]:
    """Return the outcomes of the trial of bogies, then of that of coaches."""
    text = (DOCS / "blind_trials.md").read_text("utf-8")
    bogies, coaches = (
        text.partition(f"<!-- {name} -->")[2].partition("<!-- end of")[0] for name in ("trial", "coaches")
    )
    return [*outcomes(bogies, BOGIE), *outcomes(coaches, COACH)]


def table(rows: Sequence[Outcome]) -> str:
    """Return the outcomes as a table."""
    lines = [f"| {r.name} | {r.hits} of {r.trials} | {r.percent} | {r.low} to {r.high} | {r.ideal} |" for r in rows]
    head = "| outcome | count | % | 95 % limits | ideal, % |\n| --- | ---: | ---: | ---: | ---: |"
    return "\n".join([head, *lines])


def draw(rows: Sequence[Outcome], path: Path) -> None:
    """Draw the outcomes with their limits."""
    with figure_file(path, 7.6, 4.0) as figure:
        ax = figure.subplots()
        for i, r in enumerate(rows):
            ax.plot([r.low, r.high], [-i, -i], color=BLUE, lw=2.2, solid_capstyle="round")
            ax.plot(r.percent, -i, "o", color=BLUE, ms=6)
            ax.plot(r.ideal, -i, "|", color="#222222", ms=13, mew=1.6)
        ax.set_yticks([-i for i in range(len(rows))], [f"{r.name} ({r.trials})" for r in rows])
        ax.set_xlim(-2, 102)
        ax.set_xlabel("per cent of the campaigns (of intervals); bar: 95 % limits; stroke: ideal")
        ax.grid(axis="y", visible=False)


def page(text: str) -> str:
    """Return the page with the table of the trials."""
    return re.sub(f"{BEGIN}.*?{END}", lambda _: f"{BEGIN}\n{table(summary())}\n{END}", text, flags=re.S)


if __name__ == "__main__":
    target = DOCS / "blind.md"
    target.write_text(page(target.read_text("utf-8")), "utf-8")
    draw(summary(), DOCS / "blind.svg")
