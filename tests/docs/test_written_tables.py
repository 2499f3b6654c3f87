"""Tables that a script writes into pages agree with what the script makes now."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable

import pytest

from tests.blind.assessment import TrialRow
from tests.blind.table import coverage
from tests.docs.transcript import ROOT

sys.path.insert(0, str(ROOT / "docs"))

import blind_summary
import columns
import trial_history


@pytest.mark.parametrize(
    ("name", "write"),
    [("columns", columns.page), ("blind", blind_summary.page), ("blind_trials", blind_summary.appendix)],
)
def test_a_page_has_the_tables_that_its_script_writes(name: str, write: Callable[[str], str]) -> None:
    text = (ROOT / "docs" / f"{name}.md").read_text("utf-8")
    assert write(text) == text


def test_the_present_trial_is_in_the_table_of_all_trials() -> None:
    assert trial_history.of_section(blind_summary.trial("trial")) in trial_history.read()


def test_a_trial_takes_the_place_of_that_of_its_seed() -> None:
    section = "`--loops 3 --seed {}`:\n| one effect planted: right name, class and location | {} of 3 | 67 | 9 to 99 |"
    trials = trial_history.with_trial([], trial_history.of_section(section.format(1, 2)))
    trials = trial_history.with_trial(trials, trial_history.of_section(section.format(2, 1)))
    trials = trial_history.with_trial(trials, trial_history.of_section(section.format(1, 3)))
    assert [(t["seed"], t["one effect"], t["two"]) for t in trials] == [("2", "1 of 3", ""), ("1", "3 of 3", "")]


def test_the_trials_before_are_counted_together() -> None:
    trials = [{"seed": "1, 2"} | dict.fromkeys(trial_history.COLUMNS, count) for count in ("1 of 10", "5 of 10")]
    text = trial_history.pooled(trials)
    assert text.startswith("The 4 trials before")
    assert "location, in 6 of 20 (30.0 %)" in text and "in single trials from 10 to 50 %" in text


@pytest.mark.parametrize("name", blind_summary.SENTENCES)
def test_sentences_have_the_counts_of_the_trial(name: str) -> None:
    text = (ROOT / name).read_text("utf-8")
    assert blind_summary.with_sentences(name, text) == text


def test_counts_are_written_across_lines() -> None:
    text = "one effect (lowering the error by\na tenth or more) was named in 1 of\n200 simulated cases"
    first, second = blind_summary.sentence_counts(blind_summary.NAMED)
    written = blind_summary.with_sentences("docs/blind.md", text)
    assert written == text.replace("200", str(second)).replace("in 1", f"in {first}")
    with pytest.raises(ValueError, match="lacks the sentence"):
        blind_summary.with_sentences("docs/limits.md", "no such sentence")


def test_the_first_hour_counts_the_standard_deviations_of_its_table() -> None:
    text = (ROOT / "docs/first_hour.md").read_text("utf-8")
    value, sd = map(float, re.search(r"half_width │ ([\d.]+) mm +│ ([\d.]+) mm", text).groups())  # type: ignore[union-attr]
    stated, planted = map(float, re.search(r"is ([\d.]+) standard deviations below .* ([\d.]+) mm", text).groups())  # type: ignore[union-attr]
    assert round((planted - value) / sd, 1) == stated


def test_the_page_on_vehicles_counts_the_standard_deviations_of_its_estimates() -> None:
    text = (ROOT / "docs/vehicles.md").read_text("utf-8")
    found = re.findall(r"dry_friction │.* │ ([\d.]+) (?:kN|mm/s) +│ ([\d.]+) (?:kN|mm/s)", text)
    found += re.findall(r'"value": ([\d.]+),\n +"sd": ([\d.]+),\n +"unit": "N\*s/m"', text)
    estimates = [(float(value), float(sd)) for value, sd in found]
    truth = re.search(r"has ([\d.]+) kN, ([\d.]+) mm/s and ([\d.]+) kN\*s/m", text)
    stated = re.search(r"lie ([\d.]+) and ([\d.]+) standard\s+deviations\s+below\s+and\s+([\d.]+)\s+above", text)
    assert truth is not None and stated is not None
    scales = (1.0, 1.0, 1e3)
    z = [(x - s * float(true)) / sd for (x, sd), true, s in zip(estimates, truth.groups(), scales, strict=True)]
    assert [f"{abs(each):.1f}" for each in z] == list(stated.groups())
    assert [each > 0 for each in z] == [False, False, True]


def test_the_summary_refuses_a_trial_without_a_row() -> None:
    with pytest.raises(ValueError, match="no row"):
        blind_summary.outcomes("| another outcome | 1 of 2 | 50 | 1 to 99 |\n", blind_summary.BOGIE)


def test_the_coverage_of_coaches_is_that_of_the_trial() -> None:
    rows = [f"| {name} | {k} of 9 | {percent} | 10 to 90 |" for k, percent, (name, _, _) in zip(
        (1, 2, 3, 4, 6, 7), (11, 22, 33, 44, 67, 78), blind_summary.COACH, strict=True
    )]  # fmt: skip
    text = blind_summary.coach_rates("\n".join(rows))
    assert "67 % (95 % limits 10 to 90) of the 90 % intervals of parameters and 78 % (95 % limits 10 to 90) of" in text


def test_the_rates_in_words_are_those_of_the_trial() -> None:
    """A trial of 3 loops of 5, with intervals by two sets of sensors."""
    rows = [f"| {name} | 2 of 3 | 67 | 9 to 99 |" for name, _, _ in blind_summary.BOGIE]
    by_sensors = [
        f"| 90 % intervals with the true value: sensors {name} | 8 of 10 | {percent} | 44 to 97 |"
        for name, percent in (("all", 80), ("gyro", 70), ("no gyro", 75))
    ]
    text = blind_summary.rates("\n".join(["`python -m tests.blind.blind --loops 5 --seed 1`:", *rows, *by_sensors]))
    assert "has 3 loops of 5 planned." in text and "2 of 3 pairs" in text
    assert "90 % intervals 67 % (95 % limits 9 to 99)" in text and "from 70 % (gyro) to 80 % (all)" in text
    assert "(nominal power 90 %) 67 % (95 % limits 9 to 99) were found" in text


def test_campaigns_of_one_seed_count_once_in_the_limits_of_the_coverage() -> None:
    """Six seeds, half of them with every interval right: three campaigns of each are not eighteen."""
    scores = " ".join(f"contact.spin_creep{k}={{z}}" for k in range(10))
    once = [TrialRow(seed, "nothing", "", "", "none", "", scores=scores.format(z=4 * (seed % 2))) for seed in range(6)]
    line = coverage("intervals", once)
    assert coverage("intervals", [*once, *once, *once]).split("|")[4] == line.split("|")[4]
    assert line.startswith("| intervals | 30 of 60 | 50 |")
    assert coverage("intervals", once, lambda path: path.endswith("creep3")).startswith("| intervals | 3 of 6 |")
