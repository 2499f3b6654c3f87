"""Tables of the fleet panel: vehicles by quantities with the sums of their tests, and alarms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from railui.desk.presenters.loop_text import short_path
from railui.desk.widgets.table import Column
from railui.fleet.block_means import BlockMeans
from railui.fleet.schema import read_time
from railui.report.fleet.alarm_texts import change_text, limit_day

LEVELS: Final = (0.5, 0.75, 1.0)  # of a sum over its threshold, from which a cell is shaded; 1: an alarm
HEAD_LETTERS: Final = 16
Alarms = Sequence[Mapping[str, Any]]


def vehicle_columns(document: Mapping[str, Any], means: BlockMeans | None) -> list[Column]:
    """Return a row per vehicle of a type: verdict, alarms, and the largest sum of every test over its threshold."""
    if means is None:
        return []
    rows = {row["vehicle"]: row for row in document["vehicles"] if row["type"] == means.type}
    states = [rows[name] for name in means.vehicles]
    order = tuple(map(float, range(len(states))))
    verdicts = tuple(row["verdict"] for row in states)
    counts = tuple(row["alarms"] for row in states)
    columns = [
        Column(("vehicle",), ("vehicle",), means.vehicles, order, is_text=True),
        Column(("verdict",), ("verdict",), verdicts, _alphabetic(verdicts), is_text=True),
        Column(("alarms",), ("alarms",), tuple(map(str, counts)), tuple(map(float, counts))),
    ]
    for j, name in enumerate(means.quantities):
        sums = means.largest_sum[:, j]
        heads = quantity_heads(name)
        cells = tuple(f"{x:+.2f}" if x else "0" for x in sums)
        levels = tuple(int(np.searchsorted(LEVELS, abs(x), "right")) for x in sums)
        marks = "".join("!" if level == len(LEVELS) else " " for level in levels)
        columns.append(Column(heads, heads, cells, tuple(sums.tolist()), marks, levels=levels))
    return columns


FIRST_QUANTITY: Final = 3  # column of the table of vehicles


def quantity_heads(name: str) -> tuple[str, ...]:
    """Return the lines above the column of a quantity.

    >>> quantity_heads("free_play at primary_lateral 1"), quantity_heads("error at ay1")
    (('free_play', 'primary_lateral', '1'), ('error', 'ay1'))
    """
    words = name.replace(" at ", " ").split() if " at " in name else short_path(name).split()
    return tuple(word[:HEAD_LETTERS] for word in words)


def alarm_columns(alarms: Alarms) -> list[Column]:
    """Return a row per alarm in the order of the days on which they were raised."""
    if not alarms:
        return []
    raised = tuple(row["raised"] for row in alarms)
    limits = tuple(limit_day(row["limit"]) for row in alarms)
    columns = [Column(("raised",), ("raised",), raised, tuple(map(read_time, raised)), is_text=True)]
    names = tuple(" ".join(quantity_heads(row["quantity"])) for row in alarms)  # the evidence has the whole name
    words = {key: tuple(row[key] for row in alarms) for key in ("vehicle", "verdict")} | {"quantity": names}
    for key, cells in words.items():
        columns.append(Column((key,), (key,), cells, _alphabetic(cells), is_text=True))
    return [
        *columns,
        _change_column(alarms, "change", "change"),
        _change_column(alarms, "total_change", "in total"),
        Column(("limit reached",), ("limit",), limits, tuple(map(_limit_time, alarms))),
    ]


def _change_column(alarms: Alarms, key: str, head: str) -> Column:
    """Return the column of the changes of alarms from one level, or in total."""
    values = tuple(np.nan if row.get(key) is None else float(row[key]) for row in alarms)
    return Column((head,), (head,), tuple(change_text(row, key) for row in alarms), values)


def _limit_time(alarm: Mapping[str, Any]) -> float:
    """Return the day on which a limit is reached as a number: infinite where never, NaN without a limit."""
    limit = alarm["limit"]
    if limit is not None and limit.get("exceeded_before"):
        return -np.inf
    return np.nan if limit is None else read_time(limit["day"]) if limit["day"] else np.inf


def _alphabetic(cells: Sequence[str]) -> tuple[float, ...]:
    places = {text: float(place) for place, text in enumerate(sorted(set(cells)))}
    return tuple(places[text] for text in cells)
