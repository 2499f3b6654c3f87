"""Ranges and lists of quantities."""

from __future__ import annotations

import pytest

from railui.cli.quantities import inclusive_range, parse_seeds, parse_speeds


def test_the_ends_of_a_range_are_included() -> None:
    assert inclusive_range(5.0, 90.0, 5.0) == [5.0 * i for i in range(1, 19)]
    assert parse_speeds("30:90 km/h")[0] == pytest.approx(30 / 3.6) and len(parse_speeds("5:90")) == 21
    assert parse_seeds("3,5:7") == [3, 5, 6, 7]
