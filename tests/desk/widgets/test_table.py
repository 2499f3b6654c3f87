"""Order of the rows of a table."""

from __future__ import annotations

from math import nan

import pytest

from railui.desk.presenters.fleet_tables import alarm_columns
from railui.desk.widgets.table import Column, Table


@pytest.mark.parametrize(("is_descending", "order"), [(False, [2, 4, 0, 1, 3]), (True, [0, 4, 2, 1, 3])])
def test_rows_without_a_value_come_last(is_descending: bool, order: list[int]) -> None:
    values = (3.0, nan, 1.0, nan, 2.0)
    table = Table("numbers")
    table.columns = [Column((name,), (name,), tuple(map(str, values)), values) for name in ("row", "value")]
    table.ordered_by = (1, is_descending)
    table._reorder()
    assert table.order == order


def test_alarms_are_ordered_by_the_day_of_the_limit_not_by_its_text() -> None:
    limits = [{"day": "120"}, {"day": "35.5"}, {"day": None}, None]
    alarm = {"raised": "3", "vehicle": "a", "verdict": "", "quantity": "q", "change": None, "relative_change": None}
    column = alarm_columns([{**alarm, "limit": limit} for limit in limits])[-1]
    assert column.cells[:3] == ("120", "35.5", "not reached")
    assert sorted(range(3), key=lambda row: column.values[row]) == [1, 0, 2]
