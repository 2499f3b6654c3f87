"""Write tables, rates and picture of docs/blind.md and the counts in sentences of other pages from docs/blind_trials.md.

The trial of bogies is added to the table of all trials there (trial_history).

python docs/blind_summary.py
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import trial_history

from railui.report.figures.drawing import BLUE, figure_file

DOCS = Path(__file__).parent
ROW = re.compile(r"^\| (.+?) \| (\d+) of (\d+) \| (\d+) \| (\d+) to (\d+) \|$", re.M)
BY_SENSORS = re.compile(r"^\| 90 % intervals with the true value: sensors (.+?) \| \d+ of \d+ \| (\d+) \|", re.M)
PLANNED_LOOPS = re.compile(r"--loops (\d+) --seed")
# outcome as the trials name it, its name here, and what an ideal program would have [%]
BOGIE = (
    ("one effect planted: right name, class and location", "one effect: named, at its location", 100),
    ("two effects planted: all names", "two effects: both named", 100),
    ("three effects planted: all names", "three effects: all named", 100),
    (
        "two or three effects planted: all names, or error at most 1.10 times that of the oracle",
        "two or three: all named, or error within a tenth",
        100,
    ),
    ("no effect planted: false alarm", "no effect: false alarm", 0),
    ("outside the library: verdict `outside`", "outside the library: said so", 100),
    ("verdict `outside`, one location named: it is right", "of these, where one location is named: right", 100),
    ("outside the library: an effect of the library named instead", "outside the library: wrong effect named", 0),
    (
        "detected at the minimum detectable effect (nominal power 90 %)",
        "effect of the minimum detectable size: found",
        90,
    ),
    ("90 % intervals with the true value: all parameters", "90 % intervals that contain the true value", 90),
    ("90 % intervals with the true value: added effects", "the same: sizes of effects", 90),
    ("data fault diagnosed in sound data", "data fault diagnosed in sound data", 0),
)
COACH = (
    ("one effect planted: right name and joint group", "coach, one effect: named, at its joints", 100),
    (
        "one effect planted, accelerometers on frames and floor only: right name and joint group",
        "coach, one effect, on frames and floor alone: named, at its joints",
        100,
    ),
    ("two effects planted: both names and joint groups right", "coach, two effects: both named", 100),
    ("no effect planted: false alarm", "coach, no effect: false alarm", 0),
    (
        "90 % intervals with the true value: parameters of the vehicle",
        "coach, 90 % intervals with the true value: parameters",
        90,
    ),
    (
        "90 % intervals with the true value: sizes of effects",
        "the same: effects",
        90,
    ),
)


ONE = "one effect planted: right name, class and location"
RECOGNISED = "outside the library: verdict `outside`"
WRONG = "outside the library: an effect of the library named instead"
LOCATED = "verdict `outside`, one location named: it is right"
INTERVALS = "90 % intervals with the true value: all parameters"
EFFECT_INTERVALS = "90 % intervals with the true value: added effects"
COACH_INTERVALS = "90 % intervals with the true value: sizes of effects"

# sentences and rows of other pages, with the numbers of the trials in place of {}
NAMED = "one effect (lowering the error by a tenth or more) was named in {} of {} simulated cases"
OUTSIDE = "{} of {} were recognised and {} given the name of an effect of the library"
OUTSIDE_THERE = OUTSIDE.replace("recognised and", "recognised there and")
SIZES = "{} % of those of effect sizes contained the true value"
COVERAGE = "Of the 90 % intervals {} % (95 % limits {} to {}) contain the true value"
COVERAGE_OF_SIZES = "of those of effect sizes {} % ({} to {}), on coaches {} % ({} to {})"
LOCATION = "was right in {} of {} (95 % limits {} to {} %) in the present trial of simulated campaigns"
NAMED_ROW = "one effect, lowering the error by a tenth or more: named, at its location | {} of {} |"
OUTSIDE_ROW = "discrepancy outside the library: recognised | {} of {} |"
WRONG_ROW = "discrepancy outside the library: given the name of a library effect | {} of {} |"
LOCATED_OF = "for {} of {} in the present trial, {} of them rightly"
# row of the trial and field of its outcome, for every number of a sentence
NUMBERS = {
    NAMED: ((ONE, "hits"), (ONE, "trials")),
    NAMED_ROW: ((ONE, "hits"), (ONE, "trials")),
    OUTSIDE: ((RECOGNISED, "hits"), (RECOGNISED, "trials"), (WRONG, "hits")),
    OUTSIDE_THERE: ((RECOGNISED, "hits"), (RECOGNISED, "trials"), (WRONG, "hits")),
    OUTSIDE_ROW: ((RECOGNISED, "hits"), (RECOGNISED, "trials")),
    WRONG_ROW: ((WRONG, "hits"), (WRONG, "trials")),
    LOCATION: ((LOCATED, "hits"), (LOCATED, "trials"), (LOCATED, "low"), (LOCATED, "high")),
    LOCATED_OF: ((LOCATED, "trials"), (RECOGNISED, "hits"), (LOCATED, "hits")),
    SIZES: ((EFFECT_INTERVALS, "percent"),),
    COVERAGE: ((INTERVALS, "percent"), (INTERVALS, "low"), (INTERVALS, "high")),
    COVERAGE_OF_SIZES: tuple(
        (row, field) for row in (EFFECT_INTERVALS, COACH_INTERVALS) for field in ("percent", "low", "high")
    ),
}
SENTENCES = {
    "README.md": (NAMED_ROW, OUTSIDE_ROW, WRONG_ROW, COVERAGE, COVERAGE_OF_SIZES),
    "docs/blind.md": (NAMED,),
    "docs/limits.md": (OUTSIDE, LOCATED_OF),
    "docs/measured_campaign.md": (SIZES, OUTSIDE_THERE, LOCATION),
}


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
    return [*outcomes(trial("trial"), BOGIE), *outcomes(trial("coaches"), COACH)]


def coach_rates(text: str) -> str:
    """Return in words how many intervals of coaches contain the true value.

    text: the section of the trial of coaches.
    """
    *_, parameters, effects = outcomes(text, COACH)
    return (
        f"- Coaches: {_with_limits(parameters)} of the 90 % intervals of parameters and {_with_limits(effects)} of those "
        "of effects contain the true value."
    )


def sentence_counts(sentence: str) -> list[int]:
    """Return the numbers of a sentence of SENTENCES in their order."""
    of_coaches, of_bogies = (
        {name: outcome for outcome, (name, _, _) in zip(outcomes(trial(section), names), names, strict=True)}
        for section, names in (("coaches", COACH), ("trial", BOGIE))
    )
    by_name = of_coaches | of_bogies
    return [getattr(by_name[row], field) for row, field in NUMBERS[sentence]]


def with_sentences(name: str, text: str) -> str:
    """Return a page with the numbers of the trial in its sentences; ValueError where it lacks one."""
    for sentence in SENTENCES[name]:
        words = [re.escape(word).replace(re.escape("{}"), r"(\d+)") for word in sentence.split()]
        pattern = re.compile(r"\s+".join(words), re.I)
        match = pattern.search(text)
        if match is None:
            raise ValueError(f"{name} lacks the sentence {sentence!r}")
        for group, number in reversed(list(enumerate(sentence_counts(sentence), 1))):
            text = text[: match.start(group)] + str(number) + text[match.end(group) :]
    return text


def trial(name: str) -> str:
    """Return the section of a trial in docs/blind_trials.md."""
    text = (DOCS / "blind_trials.md").read_text("utf-8")
    return text.partition(f"<!-- {name} -->")[2].partition("<!-- end of")[0]


def rates(text: str) -> str:
    """Return as a list how many effects were named, intervals hold and detection limits are true, in the trial of bogies.

    text: the section of the trial.
    """
    one, two, three, *_, power, intervals, effects, data = outcomes(text, BOGIE)
    sensors = sorted((int(percent), name) for name, percent in BY_SENSORS.findall(text))
    (low, worst), (high, best) = sensors[0], sensors[-1]
    lines = [
        f"The trial of bogies has {data.trials} loops" + _planned(text, data.trials) + ".",
        f"Named in full: {_count(one)} single effects, {_count(two)} pairs, {_count(three)} sets of three.",
        f"Of the 90 % intervals {_with_limits(intervals)} contain the true value; by sensors from {low} % ({worst}) to "
        f"{high} % ({best}). Of those of the sizes of effects {_with_limits(effects)} do.",
        f"Of the effects of the stated minimum detectable size (nominal power 90 %) {_with_limits(power)} were found.",
    ]
    return "\n".join(f"- {line}" for line in lines)


def _planned(text: str, done: int) -> str:
    """Return that a trial was stopped early, if it was."""
    planned = sum(map(int, PLANNED_LOOPS.findall(text)))
    return f" of {planned} planned" if planned > done else ""


def _count(outcome: Outcome) -> str:
    return f"{outcome.hits} of {outcome.trials}"


def _with_limits(outcome: Outcome) -> str:
    return f"{outcome.percent} % (95 % limits {outcome.low} to {outcome.high})"


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
        ax.set_xlabel("% of the campaigns (of intervals)\nbar: 95 % limits, stroke: ideal")
        ax.grid(axis="y", visible=False)


def page(text: str) -> str:
    """Return docs/blind.md with the table of the trials and the rates in words."""
    present = trial_history.of_section(trial("trial"))
    before = [t for t in trial_history.read() if t["seed"] != present["seed"]]
    text = _with_part(text, "summary", table(summary()))
    text = _with_part(text, "rates", rates(trial("trial")) + "\n" + coach_rates(trial("coaches")))
    return _with_part(text, "trials before", trial_history.pooled(before))


def appendix(text: str) -> str:
    """Return docs/blind_trials.md with the table of all trials of bogies."""
    return _with_part(text, "all trials", trial_history.table(trial_history.read()))


def _with_part(text: str, name: str, written: str) -> str:
    """Return a page with another text between two marks."""
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    return re.sub(f"{begin}.*?{end}", lambda _: f"{begin}\n{written}\n{end}", text, flags=re.S)


if __name__ == "__main__":
    trial_history.write(trial_history.with_trial(trial_history.read(), trial_history.of_section(trial("trial"))))
    for name, write in (("blind.md", page), ("blind_trials.md", appendix)):
        target = DOCS / name
        target.write_text(write(target.read_text("utf-8")), "utf-8")
    for name in SENTENCES:
        path = DOCS.parent / name
        path.write_text(with_sentences(name, path.read_text("utf-8")), "utf-8")
    draw(summary(), DOCS / "blind.svg")
