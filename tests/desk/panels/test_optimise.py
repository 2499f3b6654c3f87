"""Optimise panel: a study is searched and a design of the front taken into the form, with keys only."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from textual.widgets import Static

from railui.desk.panels.design import DesignPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.presenters.search_history import restore_search, search_content
from railui.desk.presenters.search_plots import mean_sd_text
from railui.desk.state.plan import Plan
from railui.desk.widgets.form import Form
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.table import Table
from railui.execution.session import status
from railui.vehicle.design_reader import load_design
from tests.desk.conftest import REPOSITORY, STIFFNESS, OpenDesk

pytestmark = pytest.mark.asyncio


async def test_a_study_is_searched_and_a_design_taken_within_four_keys(open_desk: OpenDesk, study: Path) -> None:
    async with open_desk(study, size=(160, 48)) as keys:
        panel, design = keys.desk.query_one(OptimisePanel), keys.desk.query_one(DesignPanel)
        await keys.press("s")
        await keys.wait_until(lambda: panel.result is not None)
        assert panel.result is not None and len(panel.generations) == 4
        x, _ = panel.front()
        assert len(x) == len(panel.result["pareto"]) == panel.query_one("#designs", Table).row_count
        await keys.press("f", "up")
        at = panel.query_one("#designs", Table).index
        assert panel.search_view.nominal is not None  # the results are shown with those of the baseline
        fresh = panel.result["pareto"][at]["fresh"]  # statistics on seeds that the search did not use
        statistics = mean_sd_text(fresh["mean"][0], fresh["sd"][0])
        assert statistics in panel.search_view.fresh_text
        assert statistics in str(panel.query_one("#search-quality", Static).content)
        assert any(line.label.startswith("new seeds") for line in panel.query_one("#front", Plot).data.lines)
        await keys.press("t")
        assert keys.count <= 4
        assert design.draft is not None
        assert design.draft.design.value(STIFFNESS) == x[at, 0]
        assert design.draft.design.name.endswith(f", design {at} of the front")
        assert design.draft.base.value(STIFFNESS) == 3e6
        assert (study.parent / "railui-study/springs/knee.yaml").exists()


async def test_the_quality_of_a_design_has_the_width_of_its_view(open_desk: OpenDesk, study: Path) -> None:
    async with open_desk(study, size=(80, 24)) as keys:
        panel = keys.desk.query_one(OptimisePanel)
        await keys.press("s")
        await keys.wait_until(lambda: panel.result is not None)
        await keys.wait_until_idle()
        await keys.press("f", "v")
        quality = panel.query_one("#search-quality", Static)
        assert quality.region.width > 70
        lines = str(quality.content).splitlines()
        assert lines[1].startswith("weighted acceleration ") and lines[2].startswith("flange margin ")


async def test_a_search_that_fails_shows_its_reason_and_remedy_until_the_next(open_desk: OpenDesk, study: Path) -> None:
    async with open_desk(study, size=(80, 24)) as keys:
        panel = keys.desk.query_one(OptimisePanel)
        assert panel.plan is not None
        (study.parent / "other").mkdir()
        (study.parent / "other/notes.txt").write_text("mine")
        first = panel.plan
        panel.set_plan(first.with_value("directory", str(study.parent / "other")))
        await keys.press("s")
        await keys.wait_until_idle()
        box, text = panel.query_one("#search-warnings"), panel.query_one("#search-warnings-text", Static)
        assert box.display and str(box.border_title).startswith("failed")
        assert "notes.txt" in str(text.content) and "choose another directory" in str(text.content)
        panel.set_plan(first)
        await keys.press("s")
        await keys.wait_until(lambda: panel.result is not None)
        assert "notes.txt" not in str(text.content)


async def test_the_warnings_of_study_and_result_stay_on_both_pages(open_desk: OpenDesk, study: Path) -> None:
    async with open_desk(study, size=(160, 48)) as keys:
        panel = keys.desk.query_one(OptimisePanel)
        box, text = panel.query_one("#search-warnings"), panel.query_one("#search-warnings-text", Static)
        assert box.display and "lateral damping secondary varies, but comfort" in str(text.content)  # of the plan
        await keys.press("s")
        await keys.wait_until(lambda: panel.result is not None)
        for _ in range(2):
            assert box.display and (box.region.height == 1) == panel.search_view.is_front_page
            assert "lateral damping secondary varies" in str(text.content)
            assert "no objective or constraint evaluates a curve" in str(text.content)
            await keys.press("f")
        assert panel.history is not None and panel.plan is not None
        again = restore_search(panel.plan, search_content(panel.history))
        assert again.warnings == panel.history.warnings and len(again.warnings) >= 2


async def test_the_default_plan_has_no_variable_that_comfort_does_not_follow() -> None:
    bogie, coach = (load_design(REPOSITORY / f"designs/{name}.yaml") for name in ("test_bogie", "manchester_coach"))
    plan = Plan.for_design(bogie, "erri_b176_low", 40.0)
    assert not plan.warnings() and "vehicle.secondary.lateral_damping" not in plan.bounds
    assert "vehicle.secondary.yaw_damping" in plan.bounds
    assert plan.with_variable("vehicle.secondary.lateral_damping").warnings()
    comfortless = replace(plan, objectives=(("maximise flange_margin", "worst"),))
    assert not comfortless.with_variable("vehicle.secondary.lateral_damping").warnings()
    assert len(Plan.for_design(coach, "erri_b176_low", 40.0).bounds) == 4  # its carbody follows


async def test_a_stopped_search_is_resumed(open_desk: OpenDesk, study: Path) -> None:
    async with open_desk(study) as keys:
        panel = keys.desk.query_one(OptimisePanel)
        assert panel.plan is not None
        panel.set_plan(replace(panel.plan, generations=40, track="erri_b176_low length=12000"))
        await keys.pilot.press("s")
        await keys.wait_until(lambda: len(panel.generations) >= 2)
        await keys.pilot.press("k")
        await keys.wait_until(lambda: panel.job is None)
        assert panel.result is None and panel.search_view.activity.startswith("stopped")
        stored = status(panel.plan.directory)
        assert stored["state"] == "interrupted" and stored["rides"] > 16
        first = panel.generations[0].objectives
        await keys.press("s")
        await keys.wait_until(lambda: panel.result is not None)
        assert len(panel.generations) == 40 and (panel.generations[0].objectives == first).all()


async def test_the_default_plan_varies_the_design_in_the_form(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(OptimisePanel)
        await keys.press("f4")
        assert panel.plan is not None and STIFFNESS in panel.plan.bounds
        await keys.press("a")
        await keys.type("wheelset mass")
        await keys.press("enter")
        assert panel.plan.bounds["vehicle.wheelset.mass"] == (460.0, 7400.0)
        assert panel.query_one(Form).field is not None
        await keys.type("1500 kg")
        await keys.press("enter")
        assert panel.plan.bounds["vehicle.wheelset.mass"] == (1500.0, 7400.0)
        await keys.type("9 t")
        await keys.press("enter")
        assert "not below" in panel.pane.error


async def test_a_standard_deviation_has_two_digits() -> None:
    assert mean_sd_text(0.149713, 0.00231) == "0.1497±0.0023"
    assert mean_sd_text(5.50871, 0.0987) == "5.509±0.099"
    assert mean_sd_text(31.2, 14.0) == "31±14"


async def test_the_study_file_of_a_plan_reads_back_the_same(study: Path) -> None:
    plan = Plan.read(study)
    again = Plan.read(plan.write_study().source)
    assert again.bounds == plan.bounds and again.objectives == plan.objectives and again.constraints == plan.constraints
    assert (again.population, again.generations, again.seeds) == (16, 4, "1")


async def test_an_unwritable_directory_is_reported(open_desk: OpenDesk, study: Path) -> None:
    async with open_desk(study, size=(160, 48)) as keys:
        panel = keys.desk.query_one(OptimisePanel)
        assert panel.plan is not None
        good = panel.plan
        for directory in (f"{study}/inside/study", "/proc/nowhere/study", "", "~nobody-of-this-name/study"):
            panel.set_plan(replace(good, directory=directory))
            await keys.press("s")
            assert panel.job is None and panel.result is None
            assert panel.search_view.activity.endswith("change the directory of the plan")
            assert panel.search_view.activity in [notification.message for notification in keys.desk._notifications]
        panel.set_plan(replace(good, generations=1))
        await keys.press("s")
        await keys.wait_until(lambda: panel.result is not None)
