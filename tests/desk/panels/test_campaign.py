"""A day's work: a campaign is adjusted, what it lacks is traced, the design is accepted; with keys alone."""

from __future__ import annotations

import gzip
import shutil
from pathlib import Path

import pytest
from textual.widgets import Static

from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.dialogs import Faults
from railui.vehicle.design_reader import load_design
from tests.desk.conftest import REPOSITORY, Sitting

pytestmark = pytest.mark.asyncio
CAMPAIGN = REPOSITORY / "designs/campaigns/worn_axle_box"


def said(panel: CampaignPanel) -> str:
    """What the pane of words says."""
    return str(panel.query_one("#told-text", Static).content)


async def test_a_campaign_is_adjusted_traced_and_accepted_within_five_keys(sit: Sitting, tmp_path: Path) -> None:
    mine = Path(shutil.copytree(CAMPAIGN, tmp_path / "campaign"))
    async with sit(mine) as keys:
        panel, design = keys.desk.query_one(CampaignPanel), keys.desk.query_one(DesignPanel)
        await keys.pilot.press("s")
        await keys.until(lambda: panel.progress.turn is not None and panel.progress.turn.iteration >= 2)
        first = {bar.name: bar.share for bar in panel.query_one("#errors", Bars).rows}
        assert set(first) == {"all", "e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2"}
        await keys.until(lambda: len(panel.query_one("#ranking", Bars).rows) > 20)
        await keys.until(lambda: panel.closed is not None)
        await keys.settle()
        assert panel.closed is not None and panel.closed.report["verdict"] == "effect"
        assert panel.query_one("#ranking", Bars).rows[0].name == "free play, primary lateral"
        # what the motions determine stands beside the verdict, as the report has it
        words = [row["word"] for row in panel.closed.report["identifiability"]["parameters"].values()]
        assert f"{words.count('determined')} determined" in str(panel.query_one("#verdict").border_title)
        assert "determined roughly: roll leading" in said(panel)
        assert panel.progress.totals["after"] < 0.2 * panel.progress.totals["before"]
        await keys.press("t")
        assert design.draft is not None and design.draft.dirty
        assert design.draft.design.adjustment is not None
        # the form compares what was found with what was declared
        assert not design.draft.base.effects and design.draft.design.effects[0].kind == "free_play"
        plan = keys.desk.query_one(OptimisePanel).plan
        assert plan is not None and plan.design.adjustment is not None  # and a search would vary what was found
        await keys.press("ctrl+s")  # it has no file of its own yet
        await keys.press("backspace")  # vehicle.yam: railui adds what is missing, and the name is free
        await keys.press("enter")
        assert keys.count + 1 <= 5
    saved = load_design(
        next(p for p in mine.iterdir() if p.name not in ("vehicle.yaml", "campaign.yaml") and p.suffix == ".yaml")
    )
    assert saved.adjustment is not None and saved.effects[0].kind == "free_play"


async def test_what_is_wrong_with_the_data_is_told_before_anything_is_fitted(sit: Sitting, tmp_path: Path) -> None:
    mine = Path(shutil.copytree(CAMPAIGN, tmp_path / "campaign"))
    head, *rows = gzip.decompress((mine / "run_a.csv.gz").read_bytes()).decode().splitlines()
    column = head.split(",").index("e1 [m]")
    cells = [row.split(",") for row in rows]
    turned = [[*c[:column], str(-float(c[column])), *c[column + 1 :]] for c in cells]  # mounted the wrong way round
    text = "\n".join([head, *(",".join(c) for c in turned)])
    (mine / "run_a.csv.gz").write_bytes(gzip.compress(text.encode()))
    async with sit(mine) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        assert panel.study is None and panel.progress.measurement is not None
        assert "check this first: run_a.csv.gz: e1 has the other sign" in said(panel)
        assert "check 1 first" in str(panel.query_one("#told").border_title)


async def test_a_loop_is_paused_and_stopped(sit: Sitting) -> None:
    async with sit(CAMPAIGN) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        await keys.pilot.press("s")
        await keys.until(lambda: panel.progress.turn is not None)
        await keys.pilot.press("p")
        assert panel.study is not None and panel.study.paused
        await keys.pilot.press("k")
        await keys.until(lambda: panel.study is None)
        assert panel.closed is None and panel.progress.doing == "stopped"


async def test_a_campaign_without_its_vehicle_shows_the_fault(sit: Sitting, tmp_path: Path) -> None:
    mine = Path(shutil.copytree(CAMPAIGN, tmp_path / "campaign"))
    (mine / "vehicle.yaml").unlink()
    async with sit(mine) as keys:
        assert isinstance(keys.desk.screen, Faults)
        assert "vehicle.yaml" in str(keys.desk.screen._text())


async def test_runs_that_cannot_be_read_say_where_before_anything_is_fitted(sit: Sitting, tmp_path: Path) -> None:
    mine = Path(shutil.copytree(CAMPAIGN, tmp_path / "campaign"))
    (mine / "run_a.csv.gz").write_bytes(gzip.compress(b"t [s],e1 [m]\n0,abc\n1,2\n"))
    async with sit(mine) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        assert "run_a.csv.gz:2:3" in said(panel) and "'abc' is no number" in said(panel)
