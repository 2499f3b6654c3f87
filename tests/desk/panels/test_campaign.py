"""Campaign panel: calibration, detection of the unmodelled effect, and taking the design, with keys only."""

from __future__ import annotations

import gzip
import shutil
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from textual.message import Message
from textual.widgets import Static

from railui.campaign.campaign import Campaign, load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.faults.fault import Diagnosis
from railui.desk.messages import DesignOffered, JobDone
from railui.desk.panels import loop_panel
from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.correcting import corrections_of_line
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.loop_computation import StoppedLoop
from railui.desk.services.loop_job import ReportWritten
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.dialogs import InputDialog, ProblemsDialog, QuestionDialog
from railui.desk.widgets.table import Table
from railui.report.loop.data_faults import CheckedData
from railui.ride_quality.evaluation import ride
from railui.vehicle.design_reader import load_design
from tests.desk.conftest import REPOSITORY, OpenDesk

pytestmark = pytest.mark.asyncio
CAMPAIGN = REPOSITORY / "designs/campaigns/worn_axle_box"


def details(panel: CampaignPanel) -> str:
    """Return the text of the data checks and the identifiability."""
    return str(panel.query_one("#details-text", Static).content)


async def test_a_campaign_is_calibrated_and_its_design_taken_within_five_keys(
    open_desk: OpenDesk, short_campaign: Path
) -> None:
    campaign = short_campaign
    async with open_desk(campaign) as keys:
        panel, design = keys.desk.query_one(CampaignPanel), keys.desk.query_one(DesignPanel)
        await keys.pilot.press("s")
        await keys.wait_until(lambda: panel.history.iteration is not None and panel.history.iteration.iteration >= 2)
        first = {bar.name: bar.fraction for bar in panel.query_one("#errors", Bars).rows}
        assert set(first) == {"all", "e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2"}
        await keys.wait_until(lambda: len(panel.query_one("#ranking", Bars).rows) > 20)
        await keys.wait_until(lambda: panel.finished is not None)
        await keys.wait_until_idle()
        assert panel.finished is not None and panel.finished.report["verdict"] == "effect"
        assert panel.query_one("#ranking", Bars).rows[0].name == "free play, primary lateral"
        # the identifiability is shown with the verdict, as in the report
        words = [row["word"] for row in panel.finished.report["identifiability"]["parameters"].values()]
        assert f"{words.count('determined')} determined" in str(panel.query_one("#verdict").border_title)
        assert "determined roughly: roll leading" in details(panel)
        assert panel.history.totals["after"] < 0.2 * panel.history.totals["before"]
        check_verdict_page(panel)
        await keys.press("t")
        assert design.draft is not None and design.draft.is_modified
        assert design.draft.design.adjustment is not None
        # the form compares the calibrated design with the nominal one
        assert not design.draft.base.effects and design.draft.design.effects[0].kind == "free_play"
        plan = keys.desk.query_one(OptimisePanel).plan
        assert plan is not None and plan.design.adjustment is not None  # a search varies the calibrated design
        declared = (campaign / "vehicle.yaml").read_text()
        await keys.press("ctrl+s", "enter")  # it has no file yet: a new name is proposed
        assert keys.count + 1 <= 5
        assert not design.draft.is_modified and (campaign / "vehicle.yaml").read_text() == declared
        saved = load_design(campaign / "vehicle_calibrated.yaml")
        assert saved.adjustment is not None and saved.effects[0].kind == "free_play"
        assert saved.content() == design.draft.design.content()
        assert design.results is not None
        conditions = design.draft.conditions
        said = ride(saved, conditions.track, conditions.speed)
        assert said["score"] == design.results[0].quality["score"]
        # a design of a front of the calibrated vehicle is another new design, not an edit of the nominal file
        stiffness = {"vehicle.primary.lateral_stiffness": 2.2e6}
        calibrated = design.draft.design
        new_path = campaign / "front.yaml"
        keys.desk.post_message(DesignOffered("design 1", calibrated.with_values(stiffness), calibrated, new_path))
        await keys.wait_until_idle()
        await keys.press("ctrl+s", "enter")
        assert (campaign / "vehicle.yaml").read_text() == declared
        assert load_design(new_path).content() == design.draft.design.content()
        assert load_design(new_path).effects[0].kind == "free_play"
        errors = {bar.name: bar.text for bar in panel.query_one("#errors", Bars).rows}
        sentence = panel.finished.report["sentence"]
        keys.desk.session.autosave.flush(60.0)
    # the process has ended, and the verdict was not written
    async with open_desk(campaign) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        assert isinstance(keys.desk.screen, QuestionDialog) and "verdict of" in keys.desk.screen.question
        await keys.press("r")
        assert panel.finished is not None and panel.finished.report["sentence"] == sentence
        assert {bar.name: bar.text for bar in panel.query_one("#errors", Bars).rows} == errors
        await keys.press("left_square_bracket")
        assert panel.page == "loop"
        await keys.wait_until_idle()
        parameters = panel.query_one("#parameters", Bars)
        assert parameters.rows or not parameters.display  # a low terminal has them in a view of their own
        await keys.press("right_square_bracket")
        assert stored_size(keys.desk.session.autosave.directory.parent) < 20e6
        rankings = panel.query_one("#rankings", Bars)
        reported = rankings.rows
        await keys.press("r")
        title = str(rankings.border_title)
        assert "Score test 1 of " in title and rankings.rows != reported
        assert rankings.rows[0].name == "free play, primary lateral"
        await keys.press(*["r"] * int(title.rpartition(" ")[2]))  # through the others, back to that of the report
        assert rankings.rows == reported
        await keys.press("s")  # another loop would replace the verdict
        assert isinstance(keys.desk.screen, QuestionDialog) and "not written" in keys.desk.screen.question
        await keys.press("w")
        assert isinstance(keys.desk.screen, InputDialog)
        await keys.press("enter")
        await keys.wait_until(lambda: panel.is_written)
        assert (campaign / "railui-loop/adjusted.yaml").exists() and (campaign / "railui-loop/report.html").exists()
        await keys.press("t")
        draft = keys.desk.query_one(DesignPanel).draft
        assert draft is not None and draft.design.content() == saved.content()


def check_verdict_page(panel: CampaignPanel) -> None:
    """Check the page of the verdict against the report."""
    assert panel.page == "verdict-page" and panel.finished is not None
    report = panel.finished.report
    stages = str(panel.query_one("#stages", Static).content)
    for key in ("declared", "before", "after"):
        assert f"{report[key]['nrmse']:.3f}" in stages
    assert "EFFECT IDENTIFIED" in str(panel.query_one("#verdict-sentence", Static).content)
    shares = {row.name: row.fraction for row in panel.query_one("#shares", Bars).rows}
    nominal, before, after = (report[key]["nrmse"] ** 2 for key in ("declared", "before", "after"))
    assert shares["removed by calibration"] == pytest.approx((nominal - before) / nominal)
    assert shares["removed by the effects"] == pytest.approx((before - after) / nominal)
    assert sum(shares.values()) == pytest.approx(1.0)
    rivals = panel.query_one("#rivals", Bars).rows
    assert len(rivals) == len(report["rivals"]) - 1
    assert [row.text.split()[-1] for row in rivals] == [
        "undecided" if row["undecided"] else "rejected" for row in report["rivals"][1:]
    ]
    assert len(panel.query_one("#next-runs", Bars).rows) == len(report["next_runs"])


def stored_size(sessions: Path) -> int:
    """Return the size of the largest stored verdict."""
    return max(file.stat().st_size for file in sessions.glob("*/verdict*.pickle"))


async def test_data_faults_are_shown_before_the_fit_and_corrected_by_a_key(
    open_desk: OpenDesk, short_campaign: Path
) -> None:
    campaign = short_campaign
    declared = (campaign / "campaign.yaml").read_text()
    head, *rows = gzip.decompress((campaign / "run_a.csv.gz").read_bytes()).decode().splitlines()
    column = head.split(",").index("e1 [m]")
    cells = [row.split(",") for row in rows]
    reversed_cells = [
        [*c[:column], str(-float(c[column])), *c[column + 1 :]] for c in cells
    ]  # sensor mounted in the wrong direction
    text = "\n".join([head, *(",".join(c) for c in reversed_cells)])
    (campaign / "run_a.csv.gz").write_bytes(gzip.compress(text.encode()))
    async with open_desk(campaign) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        assert panel.job is None and panel.history.dataset is not None
        assert (
            "check this first: run_a.csv.gz: leading wheelset relative to the rails e1 has the wrong sign"
            in details(panel)
        )
        assert "1 serious" in str(panel.query_one("#details").border_title)
        await keys.pilot.press("s")  # the loop stops before any fit
        await keys.wait_until(lambda: panel.history.stopped is not None)
        await keys.wait_until_idle()
        assert panel.page == "verdict-page" and panel.job is None
        assert "DATA FAULT" in str(panel.query_one("#verdict-sentence", Static).content)
        await keys.pilot.press("f")
        await keys.wait_until(lambda: panel.history.iteration is not None)  # the corrected data are fitted
        assert panel.history.stopped is None
        await keys.pilot.press("k")
        await keys.wait_until(lambda: panel.job is None)
        assert (campaign / "campaign.yaml").read_text() == declared


async def test_a_correction_that_was_chosen_is_that_of_its_line() -> None:
    campaign = load_campaign(CAMPAIGN)
    chosen = corrections_of_line("sensors: {e1: {delay: 80.2 ms}, track_offset: 0.3 m}", campaign)
    assert chosen.channels[0].delay == pytest.approx(0.0802) and chosen.track_offset == {"": 0.3}


async def test_several_campaigns_are_listed_and_run_one_after_another(
    open_desk: OpenDesk, tmp_path: Path, short_campaign: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = [Path(shutil.copytree(short_campaign, tmp_path / name)) for name in ("a", "b")]
    checked = []

    def stop_at_once(job: BackgroundJob, campaign: Campaign, **_: bool) -> Message:
        checked.append(campaign.source.parent.name)
        data = CheckedData(read_dataset(campaign), Diagnosis(), Diagnosis(), False, True, 0.0)
        return JobDone(job.name, StoppedLoop({"sentence": f"stopped {checked[-1]}"}, data))

    monkeypatch.setattr(loop_panel, "run_loop", stop_at_once)
    async with open_desk(paths[0]) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        keys.desk.open(paths[1])
        await keys.wait_until_idle()
        assert [entry.path.parent.name for entry in panel.entries] == ["a", "b"]
        await keys.press("right_square_bracket", "right_square_bracket", "S")
        await keys.wait_until(lambda: len(checked) == 2 and panel.job is None)
        await keys.wait_until_idle()
        assert checked == ["a", "b"]
        table = panel.query_one("#campaigns", Table)
        assert table.table_text().count("data fault") == 2
        await keys.press("up")
        assert panel.campaign is not None and panel.campaign.source.parent.name == "a"
        assert "stopped a" in str(panel.query_one("#verdict", Static).content)
        await keys.press("enter")
        assert panel.page == "loop"
        keys.desk.open(paths[0])  # again: the list keeps one entry of a campaign
        await keys.wait_until_idle()
        assert len(panel.entries) == 2 and panel.history.stopped is None


async def test_a_waiting_loop_keeps_its_options_and_a_write_marks_its_verdict(
    open_desk: OpenDesk, tmp_path: Path, short_campaign: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = [Path(shutil.copytree(short_campaign, tmp_path / name)) for name in ("a", "b")]
    started: list[tuple[str, bool, bool]] = []
    is_released = threading.Event()

    def stop_when_released(job: BackgroundJob, campaign: Campaign, *, correct: bool, accept_data: bool) -> Message:
        started.append((campaign.source.parent.name, correct, accept_data))
        is_released.wait(20.0)
        data = CheckedData(read_dataset(campaign), Diagnosis(), Diagnosis(), False, True, 0.0)
        return JobDone(job.name, StoppedLoop({"sentence": "stopped"}, data))

    monkeypatch.setattr(loop_panel, "run_loop", stop_when_released)
    async with open_desk(paths[0]) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        keys.desk.open(paths[1])
        await keys.wait_until_idle()
        first, second = panel.entries
        panel.start(first)
        panel.start(second, accept=True)
        assert second.is_waiting
        is_released.set()
        await keys.wait_until(lambda: len(started) == 2 and panel.job is None)
        assert started == [("a", False, False), ("b", False, True)]
        written, other = cast(Any, SimpleNamespace()), cast(Any, SimpleNamespace())
        first.history.finished, second.history.finished = written, other
        panel._on_written(ReportWritten(written, "written"))
        assert (first.is_written, second.is_written) == (True, False)
        first.history.finished = second.history.finished = None


async def test_unreadable_runs_and_a_missing_vehicle_are_reported_before_the_fit(
    open_desk: OpenDesk, tmp_path: Path
) -> None:
    campaign = Path(shutil.copytree(CAMPAIGN, tmp_path / "campaign"))
    (campaign / "run_a.csv.gz").write_bytes(gzip.compress(b"t [s],e1 [m]\n0,abc\n1,2\n"))
    async with open_desk(campaign) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        assert "run_a.csv.gz:2:3" in details(panel) and "'abc' is not a number" in details(panel)
        (campaign / "vehicle.yaml").unlink()
        keys.desk.open(campaign)
        await keys.wait_until_idle()
        assert isinstance(keys.desk.screen, ProblemsDialog)
        assert "vehicle.yaml" in str(keys.desk.screen.text())


async def test_a_campaign_of_a_coach_opens_on_a_small_terminal(open_desk: OpenDesk) -> None:
    async with open_desk(REPOSITORY / "designs/campaigns/worn_centre_guide", size=(80, 24)) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        runs = str(panel.query_one("#runs", Static).content)
        assert runs.count("13 channels") == 3 and runs.count("estimation") == 2
        for key in ("f2", "f4", "f5", "f6", "f3"):
            await keys.press(key)
        assert not isinstance(keys.desk.screen, ProblemsDialog)
