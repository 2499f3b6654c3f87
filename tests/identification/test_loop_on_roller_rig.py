"""The loop on a wheelset on a roller rig, on campaigns of an independent model: creep coefficients, critical speed."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import pytest
import yaml

from railui.cli import cli
from railui.running_stability.summary import stability
from tests.truth.roller_rig import Order, RigRun, write_campaign

CREEP = ("contact.wheels.conicity", "contact.wheels.longitudinal_creep", "contact.wheels.lateral_creep")
DECAYS = tuple(
    RigRun(speed, 0.0, 0.0, 10.0, (offset, 0.0, 0.0, 0.0), role)
    for speed, offset, role in (
        (42.0, 4e-3, "adjust"), (36.0, -5e-3, "adjust"), (30.0, 4e-3, "adjust"), (39.0, 4e-3, "validate"),
    )
)  # fmt: skip
HUNTING = (RigRun(53.0, 2.0, 1e-3, 30.0), RigRun(50.0, 1.5, 1e-3, 25.0, role="validate"))
ORDERS = {"day": Order(44), "decays": Order(33, DECAYS), "hunting": Order(45, HUNTING)}
pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]  # simulation in plain numpy and three loops


@dataclass(frozen=True)
class Closed:
    """Report of the loop, the true values, and the stability of the calibrated rig."""

    report: dict[str, Any]
    truth: dict[str, Any]
    stability: dict[str, Any]


@pytest.fixture(scope="module", params=list(ORDERS))
def closed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Closed:
    folder = tmp_path_factory.mktemp(request.param)
    write_campaign(ORDERS[request.param], folder)
    with pytest.raises(SystemExit) as done:
        cli(["loop", str(folder), "-o", str(folder / "out"), "--quiet"])
    assert done.value.code == 0
    report = json.loads((folder / "out/loop.json").read_text(encoding="utf-8"))
    truth = yaml.safe_load((folder / "truth.yaml").read_text(encoding="utf-8"))
    return Closed(report, truth, stability(folder / "out/adjusted.yaml"))


def test_conicity_and_creep_coefficients_are_recovered(closed: Closed) -> None:
    assert closed.report["verdict"] == "none" and closed.report["effects"] == []
    # a free limit cycle accumulates what the frequency is off
    assert closed.report["after"]["nrmse"] < 1.3 * closed.report["floor"]["nrmse"]
    assert closed.report["declared"]["nrmse"] > 2 * closed.report["after"]["nrmse"]
    for path in CREEP:
        found = closed.report["parameters"][path]
        assert abs(found["value"] - closed.truth["values"][path]) < 3 * found["sd"]
        assert found["value"] == pytest.approx(closed.truth["values"][path], rel=0.05)


def test_the_critical_speed_agrees_with_that_of_the_true_rig(closed: Closed) -> None:
    error = closed.stability["linear_critical_speed"] - closed.truth["critical_speed"]
    assert abs(error) < 0.02 * closed.truth["critical_speed"]
    assert abs(error) < 2.5 * closed.stability["linear_critical_speed_sd"]
