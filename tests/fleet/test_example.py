"""The example of a fleet: four rigs in files, one of which softens."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from railui.fleet.store import FleetStore
from tests.cli.runner import run
from tests.docs.results import rows_of, superfluous_rows, undocumented_keys
from tests.truth.rig_fleet import RigFleet

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
    # 12 % in 17 days from 101.3 % of the nominal stiffness to 50/60 of it
    assert float(first["limit"]["low"]) <= 44.3 <= float(first["limit"]["high"])


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
