"""Bars: none is clipped without a sign."""

from __future__ import annotations

import pytest
from textual.app import App, ComposeResult

from railui.desk.presenters.track_analysis import analyse_track, band_rows
from railui.desk.widgets.bars import Bar, Bars


class Shown(App[None]):
    """App with rows of bars."""

    def compose(self) -> ComposeResult:
        yield Bars("bars")


@pytest.mark.parametrize("track", ["erri_b176_low", "erri_b176_high"])
def test_bars_of_a_track_and_of_the_references_have_one_scale(track: str) -> None:
    rows = band_rows(analyse_track(f"{track} length=1000 seed=1"))
    values = [float(row.text.split()[0]) for row in rows]
    assert max(row.fraction for row in rows) == 1.0
    for row, value in zip(rows, values, strict=True):
        assert row.fraction == pytest.approx(value / max(values), rel=0.01)


@pytest.mark.asyncio
async def test_a_bar_beyond_its_scale_ends_in_an_arrow() -> None:
    app = Shown()
    async with app.run_test(size=(60, 10)) as pilot:
        bars = app.query_one(Bars)
        bars.show([Bar("link", 1.2, "120 % used"), Bar("link", 1.0, "100 % used")])
        await pilot.pause()
        over, full = (bars.render_line(y).text for y in (0, 1))
        assert "█▶" in over and "▶" not in full and "██" in full
