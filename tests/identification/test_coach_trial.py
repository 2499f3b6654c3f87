"""The blind trial of coaches: its cases, and how its rows are judged."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import yaml

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from tests.blind.assessment import TrialRow
from tests.blind.coach_cases import FLOOR_SENSORS, draw_coaches, library_entries, planted_effect
from tests.blind.coach_table import coach_totals, has_right_joints, names_wrongly, outcome
from tests.blind.coaches import groups_of
from tests.blind.realisations import Outcome, coaches_without_effect, write_realisations
from tests.blind.realisations import row as realisation_row
from tests.truth.coach_campaign import drawn, steps_of, true_values


def row(number: int, planted: str, named: str, verdict: str = "effect", **facts: object) -> TrialRow:
    errors = {"before": 0.3, "after": 0.1, "floor": 0.1, "oracle": 0.1}
    return TrialRow(number, "catalogue", planted, "", verdict, named, **{**errors, **facts})  # type: ignore[arg-type]


def test_thirty_coaches_are_drawn_in_their_sorts_the_same_again() -> None:
    cases = draw_coaches(7, (70.0, 45.0))
    assert cases == draw_coaches(7, (70.0, 45.0)) and cases != draw_coaches(8, (70.0, 45.0))
    assert Counter(case.sort for case in cases) == {"catalogue": 15, "nothing": 5, "outside": 5, "two": 5}
    assert sum(case.order.channels == FLOOR_SENSORS for case in cases) == 5
    assert all(case.sensors != "other" for case in cases)


def test_every_entry_of_the_coach_library_is_planted_with_numbers() -> None:
    for entry in library_entries():
        effect = planted_effect(entry, 0.5)
        assert effect.parameters and (effect.kind, effect.at, effect.wheelset) == entry


def test_coaches_are_grouped_by_time_step_and_none_is_lost() -> None:
    cases = draw_coaches(9, (70.0, 45.0))
    groups = groups_of(cases)
    assert sorted(c.order.seed for group in groups for c in group) == [c.order.seed for c in cases]
    assert all(len({steps_of(c.order) for c in group}) == 1 for group in groups)


def test_true_coach_differs_from_the_nominal_one_by_its_stated_values() -> None:
    first, second = (true_values(drawn(case.order)) for case in draw_coaches(10, (70.0, 45.0))[:2])
    assert first.keys() == second.keys() and all(first[path] != second[path] for path in first)


def test_truth_of_every_coach_can_be_written() -> None:
    for case in draw_coaches(11, (70.0, 45.0)):
        truth = {"effects": [e.record() for e in case.effects], "values": true_values(drawn(case.order))}
        assert yaml.safe_load(yaml.safe_dump(truth)) == truth


def test_wrong_effect_at_the_noise_floor_counts_as_clean_wrong() -> None:
    wrong = row(1, "free_play primary_lateral 3", "dry_friction primary_lateral 3", right_name=False, right_class=False)
    other = row(2, "free_play primary_lateral 3", "free_play primary_lateral", right_name=True, right_class=True)
    weak = row(3, "spring secondary_lateral", "", "none", before=0.1, right_name=False, right_class=False)
    assert names_wrongly(wrong) and not names_wrongly(other) and not names_wrongly(weak)
    assert [outcome(x) for x in (wrong, other, weak)] == ["wrong", "right", "weak"]
    assert not has_right_joints(other)
    text = "\n".join(coach_totals([wrong, other, weak]))
    assert "all names and joint groups right | 1 of 2 | 50" in text
    assert "neither planted nor alike | 1 of 3" in text
    assert "too weak to count: verdict `none` | 1 of 1" in text


def test_an_immaterial_effect_may_be_missed_but_no_other_named_in_its_place() -> None:
    planted = "hysteresis secondary_yaw + cubic_stiffness primary_yaw 3"
    missed = row(1, planted, "hysteresis secondary_yaw", right_name=False, after=0.105)
    replaced = row(2, planted, "hysteresis secondary_yaw + spring primary_yaw 3", right_name=False, after=0.105)
    material = row(3, planted, "hysteresis secondary_yaw", right_name=False, after=0.12)
    for x, share in ((missed, "1 of 1"), (replaced, "0 of 1"), (material, "0 of 1")):
        assert f"of the oracle and no wrong name | {share}" in "\n".join(coach_totals([x]))


def test_realisations_of_a_campaign_differ_by_their_noise_alone(tmp_path: Path) -> None:
    case = next(c for c in coaches_without_effect(101000, (12.0, 12.0)) if not c.nuisance)
    folders = write_realisations(case, 2, tmp_path)
    first, second = (read_dataset(load_campaign(folder)).estimation[0].columns for folder in folders)
    sd = yaml.safe_load((folders[0] / "campaign.yaml").read_text())["noise"]["d1"]
    assert np.std(first["d1"] - second["d1"]) == pytest.approx(np.sqrt(2.0) * sd, rel=0.2)
    assert np.array_equal(first["v"], second["v"])
    assert (folders[0] / "truth.yaml").read_bytes() == (folders[1] / "truth.yaml").read_bytes()


def test_the_table_of_realisations_counts_false_alarms_significant_scores_and_intervals() -> None:
    outcomes = [
        Outcome("none", 0.5, np.array([0.0, 2.0])),
        Outcome("none", 0.0005, np.array([-1.0, -2.0])),
        Outcome("effect", 0.0005, np.zeros(0)),
    ]
    assert realisation_row(("7", "all", ""), outcomes) == "| 7 | all |  | 1 of 3 | 2 of 3 | 2 of 4 | 50 | 50 to 50 |"
    assert realisation_row(("7", "all", ""), outcomes[2:]) == "| 7 | all |  | 1 of 1 | 1 of 1 | 0 of 0 |"
