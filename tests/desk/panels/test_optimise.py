"""A day's work: a study is searched, its front walked along, one design taken back; with keys alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from textual.widgets import Static

from railui.desk.panels.design import DesignPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.presenters.search_progress import spread
from railui.desk.services.work import Study
from railui.desk.state.plan import Plan
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.form import Form
from railui.desk.widgets.plot import Plot
from railui.execution.session import status
from tests.desk.conftest import Sitting

pytestmark = pytest.mark.asyncio
STIFFNESS = "vehicle.primary.lateral_stiffness"


@pytest.fixture
def study(bogie: Path) -> Path:
    """A small study of one's own."""
    path = bogie.with_name("springs.yaml")
    path.write_text(
        "vehicle: test_bogie.yaml\n"
        f"variables: {{{STIFFNESS}: [1 MN/m, 8 MN/m], vehicle.secondary.lateral_damping: [10 kN*s/m, 90 kN*s/m]}}\n"
        "cases: {track: [erri_b176_low length=300], speed: [40 m/s], seed: [1], scenario: [{}]}\n"
        "objectives: [{minimise: weighted_acceleration, over: mean}, {maximise: flange_margin, over: worst}]\n"
        "method: {kind: nsga2, population: 16, generations: 4, seed: 1}\n"
    )
    return path


async def test_a_study_is_searched_and_a_design_taken_within_four_keys(sit: Sitting, study: Path) -> None:
    async with sit(study, size=(160, 48)) as keys:
        panel, design = keys.desk.query_one(OptimisePanel), keys.desk.query_one(DesignPanel)
        await keys.press("s")
        await keys.until(lambda: panel.result is not None)
        assert panel.result is not None and len(panel.steps) == 4
        x, _ = panel.points()
        assert len(x) == len(panel.result["pareto"]) == len(panel.query_one("#designs", Bars).rows)
        await keys.press("f", "up")
        at = panel.query_one("#designs", Bars).at
        assert panel.declared is not None  # what the design does stands beside what the declared one does
        found = panel.result["pareto"][at]["fresh"]  # and its spread on seeds that the search never saw
        told = spread(found["mean"][0], found["sd"][0])
        assert told in panel.fresh and told in str(panel.query_one("#search-quality", Static).content)
        assert "fresh seeds" in [line.label for line in panel.query_one("#front", Plot).picture.lines]
        await keys.press("t")
        assert keys.count <= 4
        assert design.draft is not None
        assert design.draft.design.value(STIFFNESS) == x[at, 0]
        assert design.draft.base.value(STIFFNESS) == 3e6
        assert (study.parent / "railui-study/springs/knee.yaml").exists()


async def test_a_search_that_was_stopped_goes_on_where_it_ended(
    sit: Sitting, study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    quick = Study.checkpoint

    def waiting(self: Study, _: object = None) -> None:
        """The third generation waits for the key that stops it, however quick a search is."""
        if len(seen) < 3:
            seen.append(self)
        else:
            self.stopping.wait()
        quick(self)

    seen: list[Study] = []
    async with sit(study) as keys:
        panel = keys.desk.query_one(OptimisePanel)
        assert panel.plan is not None
        panel.set_plan(replace(panel.plan, generations=8))
        monkeypatch.setattr(Study, "checkpoint", waiting)
        await keys.pilot.press("s")
        await keys.until(lambda: len(panel.steps) >= 2)
        await keys.pilot.press("k")
        await keys.until(lambda: panel.study is None)
        assert panel.result is None and panel.doing.startswith("stopped")
        kept = status(panel.plan.directory)
        assert kept["state"] == "interrupted" and kept["rides"] > 16
        first = panel.steps[0].aims
        monkeypatch.setattr(Study, "checkpoint", quick)
        await keys.press("s")
        await keys.until(lambda: panel.result is not None)
        assert (panel.steps[0].aims == first).all()


async def test_the_plan_begins_with_the_design_in_the_form(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
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
        assert "not below" in panel.side.trouble


async def test_a_spread_has_two_digits() -> None:
    assert spread(0.149713, 0.00231) == "0.1497±0.0023"
    assert spread(5.50871, 0.0987) == "5.509±0.099"
    assert spread(31.2, 14.0) == "31±14"


async def test_the_study_file_of_a_plan_says_the_same(study: Path) -> None:
    plan = Plan.read(study)
    again = Plan.read(plan.resolved().source)
    assert again.bounds == plan.bounds and again.aims == plan.aims and again.limits == plan.limits
    assert (again.population, again.generations, again.seeds) == (16, 4, "1")


@pytest.mark.parametrize("directory", ["{file}/inside/study", "/proc/nowhere/study", "", "~nobody-of-this-name/study"])
async def test_a_directory_that_cannot_be_written_is_said_and_the_desk_goes_on(
    sit: Sitting, study: Path, directory: str
) -> None:
    async with sit(study, size=(160, 48)) as keys:
        panel = keys.desk.query_one(OptimisePanel)
        assert panel.plan is not None
        good = panel.plan
        panel.set_plan(replace(good, directory=directory.format(file=study)))
        await keys.press("s")
        assert panel.study is None and panel.result is None
        assert panel.doing.endswith("change the directory of the plan")
        assert panel.doing in [told.message for told in keys.desk._notifications]
        panel.set_plan(replace(good, generations=1))
        await keys.press("s")
        await keys.until(lambda: panel.result is not None)
