"""Table of Sobol's indices of a search, with their intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from railui.cli.tables import make_table


def sobol_table(result: Mapping[str, Any]) -> Any:
    """Return the table of first-order and total indices of every objective over the variables."""
    sobol = result["sensitivities"]["sobol"]
    objectives = [f"{aim['key']}, {aim['over']}" for aim in result["aims"]]
    columns = ("variable", *(f"{name}: {order}" for name in objectives for order in ("first order", "total")))
    rows = [
        (
            row["path"],
            *(
                _index(row[order][j], row[f"{order}_interval"][j])
                for j in range(len(objectives))
                for order in ("first", "total")
            ),
        )
        for row in sobol["variables"]
    ]
    title = f"Sobol indices over the ranges of the variables, {sobol['samples']} samples"
    caption = f"shares of the variance [{100 * sobol['confidence']:g} % interval]"
    return make_table(columns, rows, title=title, caption=caption)


def _index(value: float | None, ends: Sequence[float | None]) -> str:
    low, high = ends
    interval = "" if low is None or high is None else f" [{low:.2f}, {high:.2f}]"
    return "-" if value is None else f"{value:.2f}{interval}"
