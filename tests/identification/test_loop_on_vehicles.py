"""The loop on a coach of bodies, on a campaign of the independent coach model."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from railui.cli import cli
from tests.truth.coach import state_matrix
from tests.truth.coach_campaign import ACCELEROMETERS, ALL, Order, drawn, write_campaigns
from tests.truth.effects import Effect

FRICTION = Effect("dry_friction", "secondary_lateral", None, {"force": 5e3, "slip_speed": 0.01})
PLAY = Effect("free_play", "primary_lateral", 3, {"half_width": 0.5e-3})
DAMPING = "vehicle.elements.lateral_damper.lateral_damping"
LOST = 0.4 * 32e3  # N*s/m per side: 40 % of the declared damping
WEAK = Effect("viscous_damper", "secondary_lateral", 2, {"damping": -2 * LOST})
CASES = {
    "nothing": Order(21, channels=ACCELEROMETERS, seconds=(40.0, 30.0)),
    "friction": Order(22, (FRICTION,), channels=ALL, seconds=(40.0, 30.0)),
    "play": Order(23, (PLAY,), channels=ALL, seconds=(40.0, 30.0)),
    "weak": Order(31, (WEAK,), channels=ALL, seconds=(40.0, 30.0)),
    "hunting": Order(41, channels=ALL, seconds=(40.0, 30.0), conicity=0.35, speeds=(62.0, 56.0)),
}
# simulation in plain numpy and six loops: some eight minutes
pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("coaches")
    write_campaigns(list(CASES.values()), [folder / name for name in CASES])
    return {name: folder / name for name in CASES}


def loop(folder: Path) -> dict:
    with pytest.raises(SystemExit) as done:
        cli(["loop", str(folder), "-o", str(folder / "out"), "--quiet"])
    assert done.value.code == 0
    return json.loads((folder / "out/loop.json").read_text(encoding="utf-8"))


def test_nothing_is_missing_with_accelerometers_alone(campaigns: dict[str, Path]) -> None:
    report = loop(campaigns["nothing"])
    assert report["verdict"] == "none" and report["effects"] == []
    assert {e["kind"] for e in report["nominal_effects"]} == {"creep_saturation", "flange_contact"}
    assert len(report["groups"]) == 9 and not any(group["asks"] for group in report["groups"])
    truth = yaml.safe_load((campaigns["nothing"] / "truth.yaml").read_text(encoding="utf-8"))["values"]
    for path in ("contact.wheels.conicity", "vehicle.elements.lateral_damper.lateral_damping"):
        found = report["parameters"][path]
        assert abs(found["value"] - truth[path]) < 4 * found["sd"]


@pytest.mark.parametrize(("name", "law"), [("friction", FRICTION), ("play", PLAY)])
def test_an_effect_is_named_at_its_joint_with_its_size(campaigns: dict[str, Path], name: str, law: Effect) -> None:
    report = loop(campaigns[name])
    assert report["verdict"] == "effect" and report["after"]["nrmse"] < 1.15 * report["floor"]["nrmse"]
    assert not any(group["asks"] for group in report["groups"])
    (effect,) = report["effects"]
    assert (effect["kind"], effect["at"], effect["wheelset"]) == (law.kind, law.at, law.wheelset)
    key, value = next(iter(law.parameters.items()))
    assert effect["parameters"][key]["value"] == pytest.approx(value, rel=0.1)


def test_a_coach_that_hunts_at_the_speeds_of_its_runs_is_calibrated(campaigns: dict[str, Path]) -> None:
    true = drawn(CASES["hunting"])
    assert all(np.linalg.eigvals(state_matrix(true, v)).real.max() > 0.1 for v in CASES["hunting"].speeds)
    report = loop(campaigns["hunting"])
    assert report["verdict"] == "none" and report["effects"] == []
    assert report["declared"]["nrmse"] > 1.0 and report["after"]["nrmse"] < 1.1 * report["floor"]["nrmse"]
    conicity = report["parameters"]["contact.wheels.conicity"]
    assert abs(conicity["value"] - true.lam) < 4 * conicity["sd"] and conicity["sd"] < 0.02 * true.lam


def test_a_weaker_damper_of_one_bogie_is_no_effect_and_asks_to_be_freed(campaigns: dict[str, Path]) -> None:
    folder = campaigns["weak"]
    report = loop(folder)
    assert report["effects"] == [] and report["verdict"] == "outside" and report["outside"] is None
    asking = [group for group in report["groups"] if group["asks"]]
    assert [group["path"] for group in asking] == [DAMPING]
    assert asking[0]["differences"] == pytest.approx([LOST / 2, -LOST / 2], rel=0.1)
    assert DAMPING in report["sentence"] and DAMPING in (folder / "out/report.html").read_text(encoding="utf-8")

    with (folder / "campaign.yaml").open("a", encoding="utf-8") as file:
        file.write(f"free: [{DAMPING}]\n")
    freed = loop(folder)
    assert freed["verdict"] == "none" and freed["after"]["nrmse"] < 1.1 * freed["floor"]["nrmse"]
    assert not any(group["asks"] for group in freed["groups"])
    truth = yaml.safe_load((folder / "truth.yaml").read_text(encoding="utf-8"))["values"][DAMPING]
    for number, value in ((1, truth), (2, truth - LOST)):
        found = freed["parameters"][f"{DAMPING}.{number}"]
        assert abs(found["value"] - value) < 4 * found["sd"] and found["sd"] < 0.01 * value
