"""Page of the front: half of the screen, scaled to the front, axes of choice, a table with every limit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.desk.panels.optimise import OptimisePanel
from railui.desk.panels.shelf_page import ShelfPage
from railui.desk.presenters.front_columns import front_columns
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.table import Table
from tests.desk.conftest import Keyboard, OpenDesk

pytestmark = pytest.mark.asyncio
PATHS = ("vehicle.primary.lateral_stiffness", "vehicle.secondary.lateral_damping", "vehicle.secondary.yaw_damping")


@pytest.fixture
def study(bogie: Path) -> Path:
    """Small study of three variables."""
    path = bogie.with_name("springs.yaml")
    bounds = ("[1 MN/m, 8 MN/m]", "[10 kN*s/m, 90 kN*s/m]", "[5 kN*m*s/rad, 90 kN*m*s/rad]")
    variables = ", ".join(f"{name}: {pair}" for name, pair in zip(PATHS, bounds, strict=True))
    path.write_text(
        f"vehicle: test_bogie.yaml\nvariables: {{{variables}}}\n"
        "cases: {track: [erri_b176_low length=300], speed: [40 m/s], seed: [1], scenario: [{}]}\n"
        "objectives: [{minimise: weighted_acceleration, over: mean}, {maximise: flange_margin, over: worst}]\n"
        'constraints: ["linear_damping >= 0.02"]\n'
        "method: {kind: nsga2, population: 24, generations: 6, seed: 1}\n"
    )
    return path


async def check_filter_parallel_and_shelf(keys: Keyboard, panel: OptimisePanel) -> None:
    """Filter the designs by a value, compare the parallel co-ordinates, and put a design on the shelf."""
    table, parallel = keys.desk.query_one("#designs", Table), keys.desk.query_one("#parallel", Plot)
    table.column = 1
    table.select(table.row_count // 2)
    value = table.columns[1].values[table.index]
    await keys.press("less_than_sign")
    assert table.order == [i for i, v in enumerate(table.columns[1].values) if v <= value]
    assert f"{len(table.order)} of {table.row_count} designs" in str(table.border_subtitle)
    selected = parallel.data.lines[-1]
    assert len(parallel.data.lines) == len(table.order) and len(selected.x) == len(table.columns) - 1
    assert np.nanmin(selected.y) >= 0 and np.nanmax(selected.y) <= 1
    await keys.press("u")
    assert len(table.order) == table.row_count
    front = keys.desk.query_one("#front", Plot)
    pinned = next(mark for mark in front.data.marks if mark.label.startswith("design "))
    await keys.press("space", "up")
    assert [(m.x, m.y) for m in front.data.marks if m.character == "A"] == [(pinned.x, pinned.y)]
    await keys.press("down", "space")
    assert not any(mark.character == "A" for mark in front.data.marks)
    await keys.press("m")
    (item,) = keys.desk.query_one(ShelfPage).shelf.items
    x, _ = panel.front()
    assert [item.design.value(path) for path in PATHS] == pytest.approx(x[table.index].tolist())


async def test_the_front_fills_its_page(open_desk: OpenDesk, study: Path) -> None:
    async with open_desk(study, size=(160, 48)) as keys:
        for size, share in (((80, 24), 0.45), ((100, 30), 0.5), ((160, 48), 0.4)):
            await keys.pilot.resize_terminal(*size)
            await keys.press("f")
            plot = keys.desk.query_one("#front", Plot)
            assert plot.outer_size.width * plot.outer_size.height >= share * size[0] * size[1]
            assert keys.desk.query_one("#designs").display
            await keys.press("f")
            assert keys.desk.query_one("#plan").display and keys.desk.focused is not None


async def test_the_front_spans_its_axes_and_its_table_has_every_limit_and_orders_the_rows(
    open_desk: OpenDesk, study: Path
) -> None:
    async with open_desk(study, size=(160, 48)) as keys:
        panel = keys.desk.query_one(OptimisePanel)
        await keys.press("s")
        await keys.wait_until(lambda: panel.result is not None)
        await keys.press("f")
        plot, table = keys.desk.query_one("#front", Plot), keys.desk.query_one("#designs", Table)
        x, objectives = panel.front()
        assert len(x) > 2 and table.row_count == len(x)
        for scale, values in zip(plot.scales(), objectives.T, strict=True):
            positions = scale.position(values)
            assert 0.0 < positions.min() < 0.15 and 0.85 < positions.max() < 1.0  # no design far away sets the scale
        await check_filter_parallel_and_shelf(keys, panel)
        heads = ["\n".join(column.heads) for column in table.columns]
        for text in ("weighted acceleration", "flange margin", "yaw damping", "linear damping\n-\n>= 0.02"):
            assert any(text in head for head in heads)
        assert "primary\nlateral stiffness\nMN/m\n1 to 8" in heads
        stiffness = [float(cell) for cell in table.columns[3].cells]
        assert stiffness == pytest.approx((1e-6 * x[:, 0]).tolist(), abs=1e-2)
        damping = front_columns(panel.search_view.history)[-1]  # type: ignore[arg-type]
        assert damping.kind == "constraint" and np.all(damping.values >= 0.02)
        table.column = 1
        await keys.press("right", "right", "x")
        assert plot.data.x.label == "lateral stiffness [MN/m]" and plot.data.y.name == "flange margin"
        front = next(line for line in plot.data.lines if line.label == "front")
        assert np.allclose(front.x, 1e-6 * x[:, 0])
        await keys.press("o")
        values = np.array(table.columns[3].values)[table.order]
        assert np.all(np.diff(values) >= 0)
        await keys.press("home")
        assert table.index == int(np.argmin(x[:, 0]))
        selected = next(mark for mark in plot.data.marks if mark.label == f"design {table.index}")
        assert selected.x == pytest.approx(1e-6 * x[:, 0].min())
        before = plot.scales()
        await keys.press("r")  # all feasible designs instead of the front alone
        assert plot.scales()[1].low < before[1].low
