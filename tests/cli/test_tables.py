"""Tables on the terminal: sections, cells, and the width of 80 columns without truncation."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from rich.table import Table

from railui.cli.tables import fit_to_width, make_table, print_table

COLUMNS = (
    "speed [m/s]",
    "seed",
    "class",
    "weighted acceleration",
    "flange fraction",
    "flange margin",
    "comfort hours",
    "W_d",
)
ROW = ("1400.25", "123", "satisfactory", "0.1648312", "0.000123", "-0.000123", "12.3456", "0.162")
PATH = "vehicle.secondary.longitudinal_stiffness_of_the_trailing_bogie"


def printed(table: Table, width: int = 80) -> list[str]:
    console = Console(file=io.StringIO(), width=width)
    console.print(fit_to_width(table, console))
    return console.file.getvalue().splitlines()  # type: ignore[attr-defined]


def test_numbers_and_words_are_not_broken_where_a_table_is_too_wide() -> None:
    lines = printed(make_table(COLUMNS, [ROW]))
    assert max(map(len, lines)) <= 80
    assert any(line.split() == list(ROW) for line in lines)
    assert "…" not in "".join(lines)


def test_a_long_path_is_folded() -> None:
    row = (PATH, "200 kN*m/rad", "0 N*m/rad", "-100 %")
    lines = printed(make_table(("path", "a", "b", "change"), [row]), width=60)
    assert max(map(len, lines)) <= 60
    first_words = [line.split()[0] for line in lines if line.strip()]
    assert "".join(first_words[2:]) == PATH  # below head and rule


@pytest.mark.parametrize("width", [80, 200])
def test_a_table_that_fits_has_its_rules(width: int) -> None:
    assert printed(make_table(("a", "b"), [("1", "2")]), width)[0].startswith("┏")


def test_sections_are_separated_by_a_rule() -> None:
    lines = printed(make_table(("a", "b"), [(1, 2)], [(3, 4)]))
    assert [line[0] for line in lines] == list("┏┃┡│├│└")


def test_an_empty_section_adds_no_rule() -> None:
    assert printed(make_table(("a",), [(1,)], [])) == printed(make_table(("a",), [(1,)]))


def test_notes_are_printed_at_the_width_of_the_terminal_not_of_the_table() -> None:
    note = "linear: without creep_saturation, whose slopes at rest are in rest_critical_speed [1 of 2]"
    stream = io.StringIO()
    print_table(make_table(("a",), [(1,)], caption=f"{note}\nsecond"), stream)
    assert stream.getvalue().splitlines()[-2:] == [note, "second"]
