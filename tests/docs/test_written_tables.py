"""Tables that a script writes into pages agree with what the script makes now."""

from __future__ import annotations

import sys

import pytest

from tests.docs.transcript import ROOT

sys.path.insert(0, str(ROOT / "docs"))

import blind_summary
import columns


@pytest.mark.parametrize("module", [columns, blind_summary], ids=["columns", "blind"])
def test_a_page_has_the_tables_that_its_script_writes(module: object) -> None:
    text = (ROOT / "docs" / ("columns.md" if module is columns else "blind.md")).read_text("utf-8")
    assert module.page(text) == text  # type: ignore[attr-defined]


def test_the_summary_refuses_a_trial_without_a_row() -> None:
    with pytest.raises(ValueError, match="no row"):
        blind_summary.outcomes("| another outcome | 1 of 2 | 50 | 1 to 99 |\n", blind_summary.BOGIE)
