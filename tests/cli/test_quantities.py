"""Ranges and lists of quantities."""

from __future__ import annotations

import pytest

from railui.cli.quantities import inclusive_range, parse_seeds, parse_speeds


def test_the_ends_of_a_range_are_included() -> None:
    assert inclusive_range(5.0, 90.0, 5.0) == [5.0 * i for i in range(1, 19)]
    assert parse_speeds("30:90 km/h")[0] == pytest.approx(30 / 3.6) and len(parse_speeds("5:90")) == 21
    assert parse_seeds("3,5:7") == [3, 5, 6, 7]


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("30-60", "write 30:60:5"),
        ("30 - 60", "write 30:60:5"),
        ("30\u201360", "write 30:60:5"),
        ("60-30", "write 30:60:5"),
        ("20,100-190 km/h", "write 100:190:20 km/h"),
    ],
)
def test_a_range_with_a_hyphen_is_refused_with_the_range_meant(text: str, remedy: str) -> None:
    with pytest.raises(ValueError, match=f"is not a range: {remedy}$"):
        parse_speeds(text)


@pytest.mark.parametrize("text", ["30:700:5", "500", "-30:60"])
def test_speeds_out_of_range_stay_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"faster than any train|is not a speed"):
        parse_speeds(text)
