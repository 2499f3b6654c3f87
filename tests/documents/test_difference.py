"""Differences between two files."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.documents.difference import differences
from railui.io.problems import FileProblems

HOME = Path(__file__).parents[2]
BOGIE = HOME / "designs/test_bogie.yaml"


def test_two_designs_differ_in_their_numbers_whatever_the_units(tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    text = BOGIE.read_text("utf-8").replace("lateral_stiffness: 3.0 MN/m", "lateral_stiffness: 3300 kN/m")
    other.write_text(text + "effects: [{kind: free_play, at: primary_lateral, half_width: 0.3 mm}]\n", "utf-8")
    rows = {row["path"]: row for row in differences(BOGIE, other)}
    stiffness = rows.pop("vehicle.primary.lateral_stiffness")
    assert (stiffness["a"], stiffness["b"], stiffness["unit"]) == (3e6, 3.3e6, "N/m")
    assert stiffness["relative"] == pytest.approx(0.1)
    assert rows["effects.0.half_width"]["a"] is None and rows["effects.0.half_width"]["b"] == pytest.approx(3e-4)
    assert all(path.startswith("effects.0.") for path in rows)
    assert differences(BOGIE, BOGIE) == []


def test_files_of_two_kinds_are_not_compared() -> None:
    with pytest.raises(FileProblems, match="is a study"):
        differences(BOGIE, HOME / "designs/studies/test_bogie.yaml")


def test_a_number_of_each_joint_is_compared_with_the_shared_one(tmp_path: Path) -> None:
    coach, other = HOME / "designs/manchester_coach.yaml", tmp_path / "other.yaml"
    text = coach.read_text("utf-8").replace("lateral_damping: 32e3", "lateral_damping: [32e3, 16e3]")
    other.write_text(text, "utf-8")
    (row,) = differences(coach, other)
    assert row["path"] == "vehicle.elements.lateral_damper.lateral_damping.2"
    assert (row["a"], row["b"], row["relative"]) == (32e3, 16e3, pytest.approx(-0.5))
