"""Integration error: the required steps of the kernel are exact to 1e-4 for every kind of effect."""

from __future__ import annotations

from typing import Any

import pytest

from railui.bench.step_error import STEP_COUNTS, step_errors
from railui.core import effect_catalogue

Rows = list[dict[str, Any]]


@pytest.fixture(scope="module")
def rows() -> Rows:
    result: Rows = step_errors()["rows"]
    return result


def test_the_required_steps_are_exact_to_1e_4(rows: Rows) -> None:
    known = [row for row in rows if row["taken"] in STEP_COUNTS and row["errors"][0] is not None]
    assert len(known) > 20
    assert [row for row in known if not row["errors"][STEP_COUNTS.index(row["taken"])] < 1e-4] == []


def test_errors_fall_with_the_step(rows: Rows) -> None:
    assert all(row["errors"][-1] < 0.1 * row["errors"][0] for row in rows if row["errors"][0] is not None)


def test_every_kind_of_force_law_is_included(rows: Rows) -> None:
    laws = {record["kind"] for record in effect_catalogue() if record["acts"] not in ("sensor", "profile")}
    assert laws - {row["effects"] for row in rows} == {"measured_force", "rolling_line", "steady_force"}
