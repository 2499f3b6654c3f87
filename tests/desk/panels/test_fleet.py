"""Fleet panel: results of the last update, new results, evidence and history, faulty files."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.api.fleet import update_fleet
from railui.desk.app import Desk
from railui.desk.panels.fleet import ALARMS, HISTORY, VEHICLES, FleetPanel
from railui.desk.widgets.dialogs import ProblemsDialog
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.table import Table
from tests.desk.conftest import REPOSITORY, OpenDesk
from tests.truth.rig_fleet import RigFleet, write

pytestmark = pytest.mark.asyncio
STIFFNESS = "vehicle.rig.stiffness"


@pytest.fixture(scope="module")
def tested(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fleet of four rigs, one of which softens, with the results of an update."""
    folder = tmp_path_factory.mktemp("fleet")
    write(RigFleet(runs=30), folder)
    update_fleet(folder, jobs=1)
    return folder


@pytest.fixture
def fleet(tested: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(tested, tmp_path / "fleet")) / "fleet.yaml"


def _parts(desk: Desk) -> tuple[FleetPanel, Table, Table, Plot]:
    panel = desk.query_one(FleetPanel)
    tables = (panel.query_one(f"#{name}", Table) for name in (VEHICLES, ALARMS))
    return panel, *tables, panel.query_one(f"#{HISTORY}", Plot)  # type: ignore[return-value]


async def test_a_fleet_shows_the_results_of_its_last_update(open_desk: OpenDesk, fleet: Path) -> None:
    document = json.loads((fleet.parent / "railui-fleet/fleet.json").read_text())
    async with open_desk(fleet, (160, 48)) as keys:
        panel, vehicles, alarms, plot = _parts(keys.desk)
        assert vehicles.columns[0].cells == ("rig1", "rig2", "rig3", "rig4")
        assert alarms.columns[0].cells == tuple(row["raised"] for row in document["alarms"])
        shown = {column.heads[0]: column.cells for column in alarms.columns}
        assert shown["in total"] == tuple(f"{100 * row['relative_total_change']:+.1f} %" for row in document["alarms"])
        assert shown["in total"] != shown["change"]
        last, column = document["alarms"][-1], vehicles.columns[vehicles.column]
        assert vehicles.columns[0].cells[vehicles.index] == last["vehicle"] == "rig4"
        assert column.heads == ("stiffness", "rig")
        assert column.levels[vehicles.index] == 3
        evidence = str(panel.query_one("#fleet-evidence-text").render())
        assert last["onset"]["day"] in evidence
        assert f"{100 * last['relative_change']:+.1f} %" in evidence
        assert f"{100 * last['relative_total_change']:+.1f} %" in evidence
        means = panel.means
        assert means is not None
        value = means.value[:, 3, means.quantities.index(STIFFNESS)]
        np.testing.assert_array_equal(plot.data.lines[0].y, value[np.isfinite(value)])
        assert [line.label for line in plot.data.limits if line.is_vertical] == ["alarm"] * len(document["alarms"])

        vehicles.focus()
        await keys.press("home", "right")
        assert str(plot.border_title) == "rig1: damping rig"
        assert plot.data.y.name == "vehicle.rig.damping"
        assert [line for line in plot.data.limits if line.is_vertical] == []
        alarms.focus()
        await keys.press("home")
        assert str(plot.border_title) == "rig4: stiffness rig"
        assert plot.data.y.name == STIFFNESS


async def test_a_small_terminal_has_every_column_of_the_alarms(open_desk: OpenDesk, fleet: Path) -> None:
    async with open_desk(fleet, (80, 24)) as keys:
        await keys.press("v")
        _, _, alarms, _ = _parts(keys.desk)
        assert alarms.shown_columns() == list(range(len(alarms.columns)))
        assert set(next(c.cells for c in alarms.columns if c.heads == ("quantity",))) == {"stiffness rig"}


async def test_a_stopped_update_goes_on_where_it_was(open_desk: OpenDesk, fleet: Path) -> None:
    (fleet.parent / "railui-fleet/fleet.npz").write_bytes(b"PK damaged")
    (fleet.parent / "railui-fleet/fleet.sqlite").unlink()
    async with open_desk(fleet, (80, 24)) as keys:
        panel, vehicles, _, _ = _parts(keys.desk)
        assert vehicles.row_count == 0
        assert "s computes them" in panel.activity
        await keys.pilot.press("s", "k")
        await keys.wait_until_idle()
        assert panel.job is None
        assert panel.activity == "stopped: s goes on"
        await keys.press("s")
        assert panel.activity == "up to date"
        assert vehicles.row_count == 4
        assert panel.results is not None
        runs = panel.results.document["runs"]
        assert runs["stored"] + runs["computed"] == runs["all"] == 120


async def test_the_loop_of_an_alarm_opens_as_a_campaign(open_desk: OpenDesk, fleet: Path) -> None:
    _give_loop(fleet.parent / "railui-fleet")
    async with open_desk(fleet) as keys:
        await keys.press("l")
        assert keys.desk.panel.id == "campaign"


async def test_a_faulty_fleet_shows_its_problems(open_desk: OpenDesk, fleet: Path) -> None:
    fleet.write_text(fleet.read_text().replace("vehicles:", "vehicle:"))
    async with open_desk(fleet) as keys:
        assert isinstance(keys.desk.screen, ProblemsDialog)


def _give_loop(results: Path) -> None:
    """Give the last alarm a loop, with a campaign in its directory."""
    document: dict[str, Any] = json.loads((results / "fleet.json").read_text())
    alarm = document["alarms"][-1]
    place = Path("loops") / alarm["vehicle"]
    shutil.copytree(REPOSITORY / "designs/campaigns/worn_axle_box", results / place)
    alarm["loop"] = str(place / "loop/report.html")
    (results / "fleet.json").write_text(json.dumps(document))
