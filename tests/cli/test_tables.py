"""Tables on a terminal of 80 columns: no line is wider, no name and no number is cut short."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from rich.table import Table

from railui.cli.tables import fit_to_width

HEADS = (
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


def table(heads: tuple[str, ...], *rows: tuple[str, ...]) -> Table:
    made = Table(*heads)
    for row in rows:
        made.add_row(*row)
    return made


def test_numbers_and_words_stay_whole_where_a_table_is_too_wide() -> None:
    lines = printed(table(HEADS, ROW))
    assert max(map(len, lines)) <= 80
    assert any(line.split() == list(ROW) for line in lines)
    assert "…" not in "".join(lines)


def test_a_long_path_goes_on_below() -> None:
    lines = printed(table(("path", "a", "b", "change"), (PATH, "200 kN*m/rad", "0 N*m/rad", "-100 %")), width=60)
    assert max(map(len, lines)) <= 60
    firsts = [line.split()[0] for line in lines if line.strip()]
    assert "".join(firsts[2:]) == PATH  # below head and rule


@pytest.mark.parametrize("width", [80, 200])
def test_a_table_that_fits_keeps_its_rules(width: int) -> None:
    assert printed(table(("a", "b"), ("1", "2")), width)[0].startswith("┏")
