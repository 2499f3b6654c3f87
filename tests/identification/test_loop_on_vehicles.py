"""The loop on a coach of bodies, on a campaign of the independent coach model."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from railui.cli import cli
from tests.truth.coach_campaign import ACCELEROMETERS, ALL, Order, write_campaigns
from tests.truth.effects import Effect

FRICTION = Effect("dry_friction", "secondary_lateral", None, {"force": 5e3, "slip_speed": 0.01})
PLAY = Effect("free_play", "primary_lateral", 3, {"half_width": 0.5e-3})
CASES = {
    "nothing": Order(21, channels=ACCELEROMETERS, seconds=(40.0, 30.0)),
    "friction": Order(22, (FRICTION,), channels=ALL, seconds=(40.0, 30.0)),
    "play": Order(23, (PLAY,), channels=ALL, seconds=(40.0, 30.0)),
}
pytestmark = pytest.mark.slow  # simulation in plain numpy and three loops: some four minutes


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
    truth = yaml.safe_load((campaigns["nothing"] / "truth.yaml").read_text(encoding="utf-8"))["values"]
    for path in ("contact.wheels.conicity", "vehicle.elements.lateral_damper.lateral_damping"):
        found = report["parameters"][path]
        assert abs(found["value"] - truth[path]) < 4 * found["sd"]


@pytest.mark.parametrize(("name", "law"), [("friction", FRICTION), ("play", PLAY)])
def test_an_effect_is_named_at_its_joint_with_its_size(campaigns: dict[str, Path], name: str, law: Effect) -> None:
    report = loop(campaigns[name])
    assert report["verdict"] == "effect" and report["after"]["nrmse"] < 1.15 * report["floor"]["nrmse"]
    (effect,) = report["effects"]
    assert (effect["kind"], effect["at"], effect["wheelset"]) == (law.kind, law.at, law.wheelset)
    key, value = next(iter(law.parameters.items()))
    assert effect["parameters"][key]["value"] == pytest.approx(value, rel=0.1)
