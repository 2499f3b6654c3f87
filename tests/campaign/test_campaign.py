"""A campaign: its runs, their roles, the noise, and the defaults of what is left out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.campaign.campaign import Campaign, load_campaign
from railui.io.problems import Problem

Told = Callable[[Callable[[], object]], list[Problem]]
Records = list[dict[str, Any]]
RIG = "vehicle: {rig: {mass: 95 kg}}\n"


def rewritten(folder: Path, *changes: tuple[str, str]) -> Path:
    """The campaign with some of its text replaced or, for an empty first text, added at the end."""
    path = folder / "campaign.yaml"
    text = path.read_text()
    for old, new in changes:
        text = text.replace(old, new) if old else text + new
    path.write_text(text)
    return path


def test_what_is_left_out_takes_its_default(campaign_folder: Path) -> None:
    campaign = load_campaign(campaign_folder)
    assert (campaign.band, campaign.cut, campaign.cut_share) == ((0.3, 40.0), 2.0, 0.0)
    assert (campaign.noise_band, campaign.material, campaign.track, campaign.sensors) == (
        2.5,
        0.1,
        "unloaded",
        (),
    )
    assert len(campaign.adjust) == 17
    assert campaign.adjust[0] == "contact.leading.conicity" and campaign.adjust[-1] == "vehicle.secondary.yaw_damping"
    assert campaign.cut_of(50.0) == 2.0


def test_a_directory_or_its_file_is_the_same_campaign(campaign_folder: Path) -> None:
    assert load_campaign(campaign_folder) == load_campaign(str(campaign_folder / "campaign.yaml"))


def test_noise_is_in_si(campaign_folder: Path) -> None:
    assert load_campaign(campaign_folder).noise == {"e1": 0.05e-3, "rf": 0.3e-3}


def test_runs_keep_their_roles_and_the_names_they_are_given(campaign_folder: Path) -> None:
    campaign = load_campaign(campaign_folder)
    assert [(r.name, r.role) for r in campaign.runs] == [("run_a.csv", "adjust"), ("run_b.csv", "validate")]
    assert campaign.runs[1].file == campaign_folder / "run_b.csv"


def test_every_key_is_read(campaign_folder: Path, catalogue: Records) -> None:
    more = (
        "schema: railui.campaign/1\nnoise_band: 3 m\n"
        "adjust: [contact.leading, vehicle.frame.mass, contact.leading.roll]\n"
        "band: [0.5 Hz, 20 Hz]\ncut: 3 s\nmaterial: 0.2\n"
        "sensors: [{kind: sensor_offset, at: e1, offset: 0.2 mm}]\ntrack: loaded\n"
    )
    campaign = load_campaign(rewritten(campaign_folder, ("", more)), catalogue)
    assert campaign.adjust[-1] == "vehicle.frame.mass" and len(campaign.adjust) == 7
    assert (campaign.noise_band, campaign.band, campaign.cut, campaign.material) == (
        3.0,
        (0.5, 20.0),
        3.0,
        0.2,
    )
    assert campaign.sensors[0].parameters == {"offset": 0.2e-3}
    assert campaign.track == "loaded"


def test_every_fault_is_told_at_once_at_its_place(campaign_folder: Path, catalogue: Records, told: Told) -> None:
    rewritten(
        campaign_folder,
        ("run_a.csv", "run_A.csv"),
        ("role: validate", "role: judge"),
        ("e1: 0.05 mm, rf: 0.3 mrad/s", "e1: 0.05 kg, t: 1 ms, e3: 1, ay1: -1"),
        (
            "",
            "adjust: [contact.leadin, vehicle.primary]\nband: [40 Hz, 0.3 Hz]\ncut: 60 %\nmaterial: 2\ntrack: lost\n",
        ),
        ("", "sensors: [{kind: sensor_gain, at: e2}, {kind: free_play, at: primary_lateral}]\nbends: 3\n"),
    )
    found = told(lambda: load_campaign(campaign_folder, catalogue))
    assert [(p.line, p.column, p.key) for p in found] == [
        (4, 12, "runs.0.file"),
        (5, 29, "runs.1.role"),
        (6, 13, "noise.e1"),
        (6, 22, "noise.t"),
        (6, 31, "noise.e3"),
        (6, 43, "noise.ay1"),
        (7, 10, "adjust.0"),
        (8, 7, "band"),
        (9, 6, "cut"),
        (10, 11, "material"),
        (11, 8, "track"),
        (12, 35, "sensors.0.at"),
        (12, 47, "sensors.1.kind"),
        (13, 1, "bends"),
    ]
    assert found[0].remedy == "did you mean 'run_a.csv'?"
    assert found[6].remedy == "did you mean 'contact.leading'?"


def test_faults_of_the_vehicle_are_told_with_the_vehicle_s_name(campaign_folder: Path, told: Told) -> None:
    vehicle = campaign_folder / "vehicle.yaml"
    vehicle.write_text(vehicle.read_text().replace("55 kN", "55 m"))
    rewritten(campaign_folder, ("", "cut: 2 m\n"))
    assert [Path(p.file).name for p in told(lambda: load_campaign(campaign_folder))] == [
        "campaign.yaml",
        "vehicle.yaml",
    ]


def test_a_run_that_adjusts_cannot_judge(campaign_folder: Path, told: Told) -> None:
    rewritten(campaign_folder, ("run_b.csv", "./run_a.csv"))
    assert "stands at runs.0 already" in told(lambda: load_campaign(campaign_folder))[0].message


@pytest.mark.parametrize(("old", "new"), [("role: validate", "role: adjust"), ("role: adjust", "role: validate")])
def test_both_roles_are_needed(campaign_folder: Path, old: str, new: str, told: Told) -> None:
    rewritten(campaign_folder, (old, new))
    assert [p.key for p in told(lambda: load_campaign(campaign_folder))] == ["runs"]


def test_a_missing_campaign_or_vehicle_is_told(campaign_folder: Path, tmp_path: Path, told: Told) -> None:
    rewritten(campaign_folder, ("vehicle: vehicle.yaml", "vehicle: vehicel.yaml"))
    assert told(lambda: load_campaign(campaign_folder))[0].remedy == "did you mean 'vehicle.yaml'?"
    assert "cannot be read" in told(lambda: load_campaign(tmp_path / "nowhere"))[0].message


@pytest.fixture
def rig_folder(campaign_folder: Path) -> Path:
    """A campaign on a test bench, measured in mm and V."""
    (campaign_folder / "vehicle.yaml").write_text(RIG)
    t = np.arange(400) / 100
    for name in ("run_a.csv", "run_b.csv"):
        rows = "\n".join(f"{x:g},{np.sin(x):.6f},{np.cos(9 * x):.6f}" for x in t)
        (campaign_folder / name).write_text(f"t [s],u [V],z [mm]\n{rows}\n")
    rewritten(campaign_folder, ("e1: 0.05 mm, rf: 0.3 mrad/s", "z: 0.01 mm, u: 2 mV"))
    return campaign_folder


def test_a_rig_holds_its_mass_and_compares_without_a_band(rig_folder: Path) -> None:
    campaign: Campaign = load_campaign(rig_folder)
    assert campaign.adjust == ("vehicle.rig.stiffness", "vehicle.rig.damping", "vehicle.rig.gain")
    assert (campaign.band, campaign.cut, campaign.cut_share) == (None, 0.0, 0.02)
    assert campaign.cut_of(50.0) == 1.0


def test_noise_of_a_rig_is_in_the_units_of_its_run(rig_folder: Path) -> None:
    assert load_campaign(rig_folder).noise == {"z": 0.01, "u": 0.002}


def test_noise_of_a_rate_follows_the_unit_of_the_motion(rig_folder: Path) -> None:
    for name in ("run_a.csv", "run_b.csv"):
        path = rig_folder / name
        path.write_text(path.read_text().replace("u [V]", "az [m/s^2]"))
    rewritten(rig_folder, ("u: 2 mV", "az: 5 mm/s^2"))
    assert load_campaign(rig_folder).noise == pytest.approx({"z": 0.01, "az": 5.0})


def test_a_rig_may_free_its_mass_but_not_everything(rig_folder: Path, told: Told) -> None:
    free = "adjust: [vehicle.rig.mass, vehicle.rig.stiffness, vehicle.rig.damping]\n"
    assert load_campaign(rewritten(rig_folder, ("", free))).adjust[0] == "vehicle.rig.mass"
    rewritten(rig_folder, (free, "adjust: [vehicle.rig]\n"))
    assert "one free factor" in told(lambda: load_campaign(rig_folder))[0].message


@pytest.mark.parametrize(
    "name", ["worn_axle_box", "low_adhesion", "nothing_missing", "stiff_friction", "blind_a", "blind_b"]
)
def test_the_shared_campaigns_load(shared: Path, name: str) -> None:
    campaign = load_campaign(shared / name)
    assert len(campaign.adjust) == 17 and len(campaign.runs) == 2 and len(campaign.noise) == 11
    assert campaign.warnings == ()


@pytest.mark.parametrize("adjust", ["", "adjust: [contact.leading.conicity]\n"])
def test_a_vehicle_of_bodies_is_refused_in_one_sentence(campaign_folder: Path, adjust: str, told: Told) -> None:
    bodies = Path(__file__).parents[2] / "designs" / "manchester_coach.yaml"
    (campaign_folder / "coach.yaml").write_text(bodies.read_text())
    rewritten(campaign_folder, ("vehicle: vehicle.yaml", "vehicle: coach.yaml"), ("", adjust))
    (problem,) = told(lambda: load_campaign(campaign_folder))
    assert (problem.key, problem.line > 0) == ("vehicle", True)
    assert "vehicle of bodies" in problem.message and "bogie" in problem.message and "design" in problem.remedy
