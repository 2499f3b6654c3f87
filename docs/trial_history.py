"""All trials of bogies in one table, which docs/blind_summary.py writes from the sections that docs/blind_trials.md had."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

STORE = Path(__file__).parents[1] / "tests" / "blind" / "trials.csv"
ONE, TWO, THREE, FALSE_ALARMS = "one effect", "two", "three", "false alarms"
OUTSIDE, LOCATED, INSTEAD = "outside", "located", "library effect instead"
INTERVALS, OF_EFFECTS = "intervals", "of effects"
# column, and the row of a trial that it holds
COLUMNS = {
    ONE: "one effect planted: right name, class and location",
    TWO: "two effects planted: all names",
    THREE: "three effects planted: all names",
    "two or three, or within a tenth": (
        "two or three effects planted: all names, or error at most 1.10 times that of the oracle"
    ),
    FALSE_ALARMS: "no effect planted: false alarm",
    "minimum detectable": "detected at the minimum detectable effect (nominal power 90 %)",
    OUTSIDE: "outside the library: verdict `outside`",
    LOCATED: "verdict `outside`, one location named: it is right",
    INSTEAD: "outside the library: an effect of the library named instead",
    "data faults": "data fault diagnosed in sound data",
    INTERVALS: "90 % intervals with the true value: all parameters",
    OF_EFFECTS: "90 % intervals with the true value: added effects",
}

Trial = dict[str, str]  # by column, with the seed in the first


def read() -> list[Trial]:
    """Read the trials, the latest first."""
    with STORE.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def of_section(section: str) -> Trial:
    """Return the row of a trial from its section in docs/blind_trials.md; a count that it lacks is empty."""
    counts = dict(re.findall(r"^\| (.+?) \| (\d+ of \d+) \|", section, re.M))
    seed = ", ".join(re.findall(r"--seed (\d+)", section))
    return {"seed": seed, **{column: counts.get(row, "") for column, row in COLUMNS.items()}}


def with_trial(trials: Sequence[Trial], trial: Trial) -> list[Trial]:
    """Return the trials with one more, in the place of that of the same seed, the latest first."""
    return sorted([trial, *(t for t in trials if t["seed"] != trial["seed"])], key=lambda t: t["seed"], reverse=True)


def write(trials: Sequence[Trial]) -> None:
    """Write the trials for the next time."""
    with STORE.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["seed", *COLUMNS], lineterminator="\n")
        writer.writeheader()
        writer.writerows(trials)


def table(trials: Sequence[Trial]) -> str:
    """Return the trials as a table, one row each."""
    head = ["seed", *COLUMNS]
    lines = [head, ["---:"] * len(head), *([t[name] for name in head] for t in trials)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def pooled(trials: Sequence[Trial]) -> str:
    """Return the counts of several trials before the present one together, as a list."""
    shares = [100 * hits / of for hits, of in (_count(t[INTERVALS]) for t in trials)]
    lines = [
        f"One effect: named, at its location, in {_sum(trials, ONE)}. No effect: a false alarm in {_sum(trials, FALSE_ALARMS)}.",
        f"Two effects: both named in {_sum(trials, TWO)}. Three: all named in {_sum(trials, THREE)}.",
        f"Outside the library: said so in {_sum(trials, OUTSIDE)}, an effect of the library named instead in {_sum(trials, INSTEAD)}. "
        f"One location named: it is right in {_sum(trials, LOCATED)}.",
        f"90 % intervals that contain the true value: {_sum(trials, INTERVALS)}, in single trials from {min(shares):.0f} to "
        f"{max(shares):.0f} %; of the sizes of effects {_sum(trials, OF_EFFECTS)}.",
    ]
    count = sum(1 + t["seed"].count(",") for t in trials)
    head = f"The {count} trials before, of [earlier versions](blind_trials.md#all-trials), together:\n"
    return "\n".join([head, *(f"- {line}" for line in lines)])


def _sum(trials: Sequence[Trial], column: str) -> str:
    hits, of = map(sum, zip(*(_count(t[column]) for t in trials if t[column]), strict=True))
    return f"{hits} of {of} ({100 * hits / of:.1f} %)"


def _count(text: str) -> tuple[int, int]:
    hits, _, of = text.partition(" of ")
    return int(hits), int(of)
