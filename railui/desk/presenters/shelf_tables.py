"""Tables of the shelf: all designs with results and the parameters in which they differ; the difference of two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from railui.desk.presenters.design_results import DesignResults
from railui.desk.presenters.loop_text import short_path
from railui.desk.presenters.ride_quality import EXTRA_ROWS, MAIN_ROWS, quality_values, value_text
from railui.desk.state.shelf import ShelfItem
from railui.desk.widgets.table import Column
from railui.io.number_format import format_quantity, typeset
from railui.io.problems import FileProblems
from railui.vehicle.design_reader import Design

MISSING: Final = "–"
NOTE_COLUMNS: Final = 24
NAN: Final = float("nan")


def shelf_columns(items: Sequence[ShelfItem], results: Mapping[str, DesignResults], reference: str) -> list[Column]:
    """Return the table of the shelf: a row per design; reference: letter of the design of the comparison."""
    if not items:
        return []
    letters = tuple(f"{item.letter}{'*' if item.letter == reference else ''}" for item in items)
    notes = tuple(item.note[:NOTE_COLUMNS] or item.origin[:NOTE_COLUMNS] for item in items)
    columns = [
        Column(("",), ("",), letters, tuple(map(float, range(len(items)))), is_text=True),
        Column(("note",), ("note",), notes, tuple(float(sorted(notes).index(note)) for note in notes), is_text=True),
    ]
    values = [quality_values(results[item.letter]) if item.letter in results else {} for item in items]
    for row in MAIN_ROWS:
        numbers = [each.get(row.key) for each in values]
        cells = tuple(value_text(n, row.unit) if each else "..." for n, each in zip(numbers, values, strict=True))
        heads = tuple(row.short_name.split())
        columns.append(Column(heads, heads, cells, tuple(NAN if n is None else float(n) for n in numbers)))
    for path in differing_paths([item.design for item in items]):
        numbers = [path_value(item.design, path) for item in items]
        cells = tuple(_parameter_text(item.design, path) for item in items)
        heads = tuple(short_path(path).split())
        columns.append(
            Column(heads, tuple(head[:9] for head in heads), cells, tuple(NAN if n is None else n for n in numbers))
        )
    return columns


def differing_paths(designs: Sequence[Design]) -> list[str]:
    """Return the paths of the parameters that are not the same in all designs, in the order of the form."""
    paths = dict.fromkeys(path for design in designs for path in design.paths())
    return [path for path in paths if len({path_value(design, path) for design in designs}) > 1]


def path_value(design: Design, path: str) -> float | None:
    """Return the value of a parameter, None if the design has none."""
    try:
        value = design.value(path)
    except ValueError:
        return None
    return float(value) if isinstance(value, int | float) else None


def _parameter_text(design: Design, path: str) -> str:
    value = path_value(design, path)
    if value is None:
        return MISSING
    try:
        unit = design.unit(path)
    except FileProblems:
        unit = "1"
    return typeset(format_quantity(value, unit, 4))


def difference_columns(
    item: ShelfItem, reference: ShelfItem, results: Mapping[str, DesignResults], name_columns: int
) -> list[Column]:
    """Return the table of the differences of a design from another: results first, then parameters.

    name_columns: width to which names are cut.
    """
    rows = _result_differences(item, reference, results) + [
        (short_path(path), _parameter_text(item.design, path), _parameter_text(reference.design, path), change)
        for path in differing_paths([item.design, reference.design])
        for change in (relative_change(path_value(item.design, path), path_value(reference.design, path)),)
    ]
    kinds = effect_difference(item.design, reference.design)
    rows += [(text, *cells, NAN) for text, cells in kinds]
    if not rows:
        return []
    full_names, cells, others, changes = zip(*rows, strict=True)
    names = tuple(name[:name_columns] for name in full_names)
    order = tuple(map(float, range(len(names))))
    texts = tuple(MISSING if change != change else f"{100 * change:+.3g} %" for change in changes)
    return [
        Column(("quantity",), ("quantity",), names, order, is_text=True),
        Column((item.letter,), (item.letter,), cells, order),
        Column((reference.letter,), (reference.letter,), others, order),
        Column(("change",), ("change",), texts, tuple(changes)),
    ]


def _result_differences(
    item: ShelfItem, reference: ShelfItem, results: Mapping[str, DesignResults]
) -> list[tuple[str, str, str, float]]:
    if item.letter not in results or reference.letter not in results:
        return []
    values, others = (quality_values(results[each.letter]) for each in (item, reference))
    return [
        (row.name, value_text(values[row.key], row.unit), value_text(others[row.key], row.unit), change)
        for row in (*MAIN_ROWS, *EXTRA_ROWS)
        for change in (relative_change(values[row.key], others[row.key]),)
        if values[row.key] is not None or others[row.key] is not None
    ]


def relative_change(value: Any, reference: Any) -> float:
    """Return (value - reference)/|reference|; NaN where it has no meaning."""
    if value is None or reference is None or not reference:
        return 0.0 if value == reference and value is not None else NAN
    return float((value - reference) / abs(reference))


def effect_difference(design: Design, reference: Design) -> list[tuple[str, tuple[str, str]]]:
    """Return the effects that only one of two designs has."""
    names = [[f"{e.kind} {e.at} {e.wheelset or ''}".strip() for e in each.effects] for each in (design, reference)]
    cells = {True: "present", False: MISSING}
    return [
        (name.replace("_", " "), (cells[name in names[0]], cells[name in names[1]]))
        for name in dict.fromkeys([*names[0], *names[1]])
        if (name in names[0]) != (name in names[1])
    ]
