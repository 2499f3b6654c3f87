"""Tables that a script writes into pages agree with what the script makes now."""

from __future__ import annotations

import re
import sys

import pytest

from tests.blind.assessment import TrialRow
from tests.blind.table import coverage
from tests.docs.transcript import ROOT

sys.path.insert(0, str(ROOT / "docs"))

import blind_summary
import columns


@pytest.mark.parametrize("module", [columns, blind_summary], ids=["columns", "blind"])
def test_a_page_has_the_tables_that_its_script_writes(module: object) -> None:
    text = (ROOT / "docs" / ("columns.md" if module is columns else "blind.md")).read_text("utf-8")
    assert module.page(text) == text  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", blind_summary.SENTENCES)
def test_sentences_have_the_counts_of_the_trial(name: str) -> None:
    text = (ROOT / name).read_text("utf-8")
    assert blind_summary.with_sentences(name, text) == text


def test_counts_are_written_across_lines() -> None:
    text = "Of these 1 of\n200 were recognised and 33 were given the name of a library effect."
    first, second, third = blind_summary.sentence_counts(blind_summary.OUTSIDE)
    written = blind_summary.with_sentences("docs/limits.md", text)
    assert written == text.replace("200", str(second)).replace("33", str(third)).replace("these 1", f"these {first}")
    with pytest.raises(ValueError, match="lacks the sentence"):
        blind_summary.with_sentences("docs/limits.md", "no such sentence")


def test_the_first_hour_counts_the_standard_deviations_of_its_table() -> None:
    text = (ROOT / "docs/first_hour.md").read_text("utf-8")
    value, sd = map(float, re.search(r"half_width │ ([\d.]+) mm +│ ([\d.]+) mm", text).groups())  # type: ignore[union-attr]
    stated, planted = map(float, re.search(r"is ([\d.]+) standard deviations below .* ([\d.]+) mm", text).groups())  # type: ignore[union-attr]
    assert round((planted - value) / sd, 1) == stated


def test_the_summary_refuses_a_trial_without_a_row() -> None:
    with pytest.raises(ValueError, match="no row"):
        blind_summary.outcomes("| another outcome | 1 of 2 | 50 | 1 to 99 |\n", blind_summary.BOGIE)


def test_the_coverage_of_coaches_is_that_of_the_trial() -> None:
    rows = [f"| {name} | {k} of 9 | {percent} | 10 to 90 |" for k, percent, (name, _, _) in zip(
        (1, 2, 3, 6, 7), (11, 22, 33, 67, 78), blind_summary.COACH, strict=True
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
