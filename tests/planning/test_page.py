"""docs/plan.md has the results of the stored trials."""

from __future__ import annotations

from tests.planning.page import PAGE, page_text


def test_the_page_has_the_results_of_both_trials() -> None:
    assert page_text().strip() in PAGE.read_text("utf-8")
