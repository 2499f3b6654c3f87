"""The example of a fleet: four rigs in files, one of which softens."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from railui.fleet.store import FleetStore
from tests.cli.runner import run
from tests.docs.results import rows_of, superfluous_rows, undocumented_keys
from tests.truth.rig_fleet import RigFleet, stiffness, temperature

RIGS = Path(__file__).parents[2] / "designs/fleets/rigs"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    assert run("fleet", "run", str(RIGS), "-o", str(folder), "--jobs", "1", "-q").exit_code == 0
    return folder


@pytest.fixture(scope="module")
def document(results: Path) -> dict[str, Any]:
    return dict(json.loads((results / "fleet.json").read_text()))


def test_only_the_rig_that_softens_raises_alarms(document: dict[str, Any]) -> None:
    verdicts = {row["vehicle"]: row["verdict"] for row in document["vehicles"]}
    assert verdicts == {"rig1": "none", "rig2": "none", "rig3": "none", "rig4": "parameter"}
    assert {row["quantity"] for row in document["alarms"]} == {"vehicle.rig.stiffness"}


def test_onset_and_limit_of_the_first_alarm_are_those_of_the_generator(document: dict[str, Any]) -> None:
    order, first = RigFleet(), document["alarms"][0]
    onset = order.onset + 1  # runs are numbered from 1
    assert float(first["onset"]["low"]) - 1.0 <= onset <= float(first["onset"]["high"]) + 1.0
    assert float(first["raised"]) < onset + 6


def test_a_change_that_goes_on_is_stated_in_total_and_forecast_from_all_its_blocks(document: dict[str, Any]) -> None:
    order, alarms = RigFleet(), document["alarms"]
    span = order.runs - 1 - order.onset
    own = stiffness(order, order.rigs - 1, 0) / (1.0 - 0.002 * (temperature(order, 0) - 15.0))  # at 15 degC
    reached = order.onset + 1 + span * (1.0 - 50e3 / own) / order.loss  # 44.2
    widths = []
    for row in alarms:
        low, high = (float(row["limit"][end]) for end in ("low", "high"))
        assert low <= reached <= high
        widths.append(high - low)
        assert abs(float(row["onset"]["day"]) - (order.onset + 1)) < 0.5
    assert widths == sorted(widths, reverse=True) and widths[-1] < 0.2 * widths[0]
    assert alarms[0]["total_change"] == alarms[0]["change"]
    last = alarms[-1]
    loss = -order.loss * own
    assert loss < last["total_change"] < 0.8 * loss < 2.0 * last["change"]  # the mean of its last blocks


@pytest.mark.parametrize(("since", "is_right"), [("25", True), ("2026-06-01", False)])
def test_a_day_is_of_the_kind_of_the_fleet(results: Path, since: str, is_right: bool) -> None:
    done = run("fleet", "status", str(RIGS), "-o", str(results), "--since", since)
    assert done.exit_code == (0 if is_right else 2)
    assert is_right or "numbers of days" in done.stderr
    assert "stated rate 0.02 false alarms" in done.stdout or not is_right


def test_the_page_has_every_alarm(results: Path, document: dict[str, Any]) -> None:
    page = (results / "fleet.html").read_text()
    assert all(f"{row['vehicle']}, {row['raised']}: {row['quantity']}" in page for row in document["alarms"])
    assert "http" not in page.replace("http-equiv", "").replace("http://www.w3.org", "")


def test_the_store_has_the_alarms_of_the_document(results: Path, document: dict[str, Any]) -> None:
    store = FleetStore(results, readonly=True)
    found = store.alarms()
    store.close()
    assert [(row["vehicle"], row["raised"]) for row in found] == [
        (row["vehicle"], row["raised"]) for row in document["alarms"]
    ]


def test_the_page_of_results_lists_exactly_the_keys(document: dict[str, Any]) -> None:
    rows = rows_of("fleet")
    assert undocumented_keys([document], rows) == []
    assert superfluous_rows([document], rows) == []
