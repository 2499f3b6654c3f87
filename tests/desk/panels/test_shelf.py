"""Shelf of designs: keeping, comparing, notes, restoring; export of all pictures and tables."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from PIL import Image

from railui.desk.panels.design import DesignPanel
from railui.desk.panels.shelf_page import ShelfPage, ShelfTable
from railui.desk.presenters.ride_quality import MAIN_ROWS
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.table import Table
from railui.ride_quality.evaluation import ride
from tests.desk.conftest import OpenDesk

pytestmark = pytest.mark.asyncio
STIFFNESS = "vehicle.primary.lateral_stiffness"
TRACK = "erri_b176_low length=300 seed=1"


@pytest.fixture
def short_track(tmp_path: Path) -> None:
    """Session state with a short track."""
    directory = tmp_path / "state/railui"
    directory.mkdir(parents=True)
    (directory / "desk.json").write_text(json.dumps({"track": TRACK}))


@pytest.mark.usefixtures("short_track")
async def test_two_designs_of_the_shelf_are_compared_edited_and_restored(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie, size=(160, 48)) as keys:
        panel, page = keys.desk.query_one(DesignPanel), keys.desk.query_one(ShelfPage)
        await keys.press("m")
        panel.set(STIFFNESS, 7e6)
        await keys.press("m", "left_square_bracket")
        assert panel.page is page
        keys.desk.query_one(ShelfTable).focus()
        await keys.press("down", "n")
        await keys.type("stiff")
        await keys.press("enter")
        await keys.wait_until(lambda: len(page.evaluated) == 2)
        await keys.wait_until_idle()
        rows = page.table.table_text().splitlines()
        assert rows[1].startswith("A*\ttest_bogie.yaml") and rows[2].startswith("B\tstiff")
        score = rows[0].split("\t").index(MAIN_ROWS[0].short_name)
        for row, item in zip(rows[1:], page.shelf.items, strict=True):
            assert row.split("\t")[score] == f"{ride(item.design, TRACK, 40.0)['score']:.3g}"
        difference = page.query_one("#shelf-difference", Table).table_text()
        assert "lateral stiffness primary\t7 MN/m\t3 MN/m\t+133 %" in difference
        assert page.shelf.items[1].history == ("as opened", "primary lateral stiffness")
        panel.set(STIFFNESS, 5e6)
        keys.desk.query_one(ShelfTable).focus()
        await keys.press("enter")  # edits B with A as base
        assert panel.draft is not None and panel.draft.design.value(STIFFNESS) == 7e6
        assert panel.draft.base.value(STIFFNESS) == 3e6
        await keys.press("ctrl+z")
        assert panel.draft.design.value(STIFFNESS) == 5e6
        panel.draft.undo()
        panel.draft.undo()
        keys.desk.session.drop_form()
    async with open_desk(bogie, size=(160, 48)) as keys:
        await keys.press("r")
        page = keys.desk.query_one(ShelfPage)
        assert [(item.letter, item.note) for item in page.shelf.items] == [("A", ""), ("B", "stiff")]
        assert page.shelf.items[1].design.value(STIFFNESS) == 7e6
        keys.desk.query_one(DesignPanel).show_page("shelf")
        keys.desk.query_one(ShelfTable).focus()
        await keys.wait_until_idle()
        await keys.press("delete", "r")
        assert [item.letter for item in page.shelf.items] == ["B"] and page.reference == "B"


@pytest.mark.usefixtures("short_track")
async def test_all_pictures_and_tables_of_a_panel_are_exported(
    open_desk: OpenDesk, bogie: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    async with open_desk(bogie) as keys:
        command = next(c for c in keys.desk.get_system_commands(keys.desk.screen) if c.title == "Export all")
        command.callback()
        await keys.wait_until_idle()
        await keys.press("enter")
        await keys.wait_until_idle()
        directory = tmp_path / "railui-design"
        plots = [plot for plot in keys.desk.query("#plots Plot").results(Plot) if plot.data.lines]
        assert len(list(directory.glob("*.svg"))) == len(list(directory.glob("*.png"))) == len(plots) > 3
        with Image.open(directory / "comfort_spectrum.png") as picture:
            assert picture.width > 1000
        results = keys.desk.query_one(DesignPanel).results
        assert results is not None
        score = next(line for line in (directory / "ride_quality.csv").read_text().splitlines() if "score" in line)
        assert score.split(",")[2] == f"{results[0].quality['score']:.9g}"
