"""Layout of a search: the front takes half of the room, or half of the screen on its own page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from textual.containers import Grid
from textual.widget import Widget

from railui.desk.panels.common import PLOT_COLUMNS, PLOT_ROWS

FRONT: Final = "front"
TABLE: Final = "designs"
DETAILS: Final = ("search-quality", "parallel", "search-displacement", "search-comfort", "convergence")
PARTS: Final = (FRONT, TABLE, *DETAILS)
DETAIL_COLUMNS: Final = 46  # of the details, right of the front
MIN_COLUMNS_WITH_DETAILS: Final = 132
MIN_TABLE_ROWS: Final = 9  # with border and headings
TABLE_SHARE: Final = 0.38  # of the height, on the page of the front


@dataclass(frozen=True)
class Placed:
    """Part with the number of columns and rows of the grid that it covers."""

    name: str
    columns: int = 1
    rows: int = 1


@dataclass(frozen=True)
class Layout:
    """Columns and rows of a grid, and its parts in their order."""

    columns: str
    rows: str
    parts: tuple[Placed, ...]


def search_layout(width: int, height: int, view: int, is_front_page: bool) -> Layout:
    """Return the layout for an area in cells; view: number of the first detail that is shown, modulo their number."""
    if is_front_page:
        return _front_page(width, height, view)
    if height < 2 * PLOT_ROWS:
        return Layout("1fr", "1fr", (Placed(PARTS[view % len(PARTS)]),))
    others = _rotated((TABLE, *DETAILS), view)
    count = max(1, min(2, width // PLOT_COLUMNS))
    columns = " ".join(["1fr"] * count)
    return Layout(columns, "1fr 1fr", (Placed(FRONT, count), *(Placed(name) for name in others[:count])))


def _front_page(width: int, height: int, view: int) -> Layout:
    table_rows = max(MIN_TABLE_ROWS, round(TABLE_SHARE * height))
    if width < MIN_COLUMNS_WITH_DETAILS:
        lower = (TABLE, *DETAILS)[view % (1 + len(DETAILS))]
        return Layout("1fr", f"1fr {table_rows}", (Placed(FRONT), Placed(lower)))
    details = _rotated(DETAILS, view)[: max(1, min(2, (height - table_rows) // PLOT_ROWS))]
    rows = " ".join(["1fr"] * len(details))
    placed = (Placed(FRONT, rows=len(details)), *(Placed(name) for name in details), Placed(TABLE, columns=2))
    return Layout(f"1fr {DETAIL_COLUMNS}", f"{rows} {table_rows}", placed)


def _rotated(names: Sequence[str], by: int) -> list[str]:
    return [names[(by + k) % len(names)] for k in range(len(names))]


def apply_layout(grid: Grid, widgets: Mapping[str, Widget], layout: Layout) -> None:
    """Arrange the parts of a grid; parts that the layout lacks are hidden."""
    order = [placed.name for placed in layout.parts]
    grid.styles.grid_columns = layout.columns
    grid.styles.grid_rows = layout.rows
    grid.styles.grid_size_columns = len(layout.columns.split())
    grid.styles.grid_size_rows = len(layout.rows.split())
    for name, widget in widgets.items():
        widget.display = name in order
    for placed in layout.parts:
        widgets[placed.name].styles.column_span = placed.columns
        widgets[placed.name].styles.row_span = placed.rows
    ids = {str(widget.id): name for name, widget in widgets.items()}
    grid.sort_children(key=lambda part: order.index(ids[str(part.id)]) if ids[str(part.id)] in order else len(order))
