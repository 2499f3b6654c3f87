"""Reading a campaign: its runs, their roles, the noise, the defaults and the reported faults."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.campaign.campaign import Campaign, load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.stated_noise import read_stated_noise
from railui.io.problems import FileProblems, Findings, Problem

Problems = Callable[[Callable[[], object]], list[Problem]]
Records = list[dict[str, Any]]
RIG = "vehicle: {rig: {mass: 95 kg}}\n"


def rewrite(folder: Path, *changes: tuple[str, str]) -> Path:
    """Replace some text of the campaign file or, for an empty old text, add the new one at the end."""
    path = folder / "campaign.yaml"
    text = path.read_text()
    for old, new in changes:
        text = text.replace(old, new) if old else text + new
    path.write_text(text)
    return path


def test_missing_keys_take_their_defaults(campaign_folder: Path) -> None:
    campaign = load_campaign(campaign_folder)
    assert (campaign.band, campaign.cut, campaign.cut_share) == ((0.3, 40.0), 2.0, 0.0)
    assert (campaign.noise_band, campaign.min_relative_gain, campaign.track, campaign.sensors) == (
        2.5,
        0.1,
        "unloaded",
        (),
    )
    assert len(campaign.estimated_parameters) == 17
    assert (
        campaign.estimated_parameters[0] == "contact.leading.conicity"
        and campaign.estimated_parameters[-1] == "vehicle.secondary.yaw_damping"
    )
    assert campaign.cut_length(50.0) == 2.0


def test_a_campaign_is_read_from_its_directory_or_its_file(campaign_folder: Path) -> None:
    assert load_campaign(campaign_folder) == load_campaign(str(campaign_folder / "campaign.yaml"))


def test_noise_is_converted_to_si(campaign_folder: Path) -> None:
    assert load_campaign(campaign_folder).noise == {"e1": 0.05e-3, "rf": 0.3e-3}


def test_runs_keep_their_roles_and_names(campaign_folder: Path) -> None:
    campaign = load_campaign(campaign_folder)
    assert [(r.name, r.role) for r in campaign.runs] == [("run_a.csv", "adjust"), ("run_b.csv", "validate")]
    assert campaign.runs[1].file == campaign_folder / "run_b.csv"


def test_every_key_is_read(campaign_folder: Path, catalogue: Records) -> None:
    keys = (
        "schema: railui.campaign/1\nnoise_band: 3 m\n"
        "adjust: [contact.leading, vehicle.frame.mass, contact.leading.roll]\n"
        "band: [0.5 Hz, 20 Hz]\ncut: 3 s\nmaterial: 0.2\n"
        "sensors: [{kind: sensor_offset, at: e1, offset: 0.2 mm}]\ntrack: loaded\n"
    )
    campaign = load_campaign(rewrite(campaign_folder, ("", keys)), catalogue)
    assert campaign.estimated_parameters[-1] == "vehicle.frame.mass" and len(campaign.estimated_parameters) == 7
    assert (campaign.noise_band, campaign.band, campaign.cut, campaign.min_relative_gain) == (
        3.0,
        (0.5, 20.0),
        3.0,
        0.2,
    )
    assert campaign.sensors[0].parameters == {"offset": 0.2e-3}
    assert campaign.track == "loaded"


def test_every_fault_is_reported_with_line_and_column(
    campaign_folder: Path, catalogue: Records, problems_of: Problems
) -> None:
    rewrite(
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
    problems = problems_of(lambda: load_campaign(campaign_folder, catalogue))
    assert [(p.line, p.column, p.key) for p in problems] == [
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
    assert problems[0].remedy == "did you mean 'run_a.csv'?"
    assert problems[6].remedy == "did you mean 'contact.leading'?"


def test_faults_of_the_vehicle_name_the_vehicle_file(campaign_folder: Path, problems_of: Problems) -> None:
    vehicle = campaign_folder / "vehicle.yaml"
    vehicle.write_text(vehicle.read_text().replace("55 kN", "55 m"))
    rewrite(campaign_folder, ("", "cut: 2 m\n"))
    assert [Path(p.file).name for p in problems_of(lambda: load_campaign(campaign_folder))] == [
        "campaign.yaml",
        "vehicle.yaml",
    ]


def test_a_run_cannot_serve_estimation_and_validation(campaign_folder: Path, problems_of: Problems) -> None:
    rewrite(campaign_folder, ("run_b.csv", "./run_a.csv"))
    assert "already listed at runs.0" in problems_of(lambda: load_campaign(campaign_folder))[0].message


@pytest.mark.parametrize(("old", "new"), [("role: validate", "role: adjust"), ("role: adjust", "role: validate")])
def test_both_roles_are_required(campaign_folder: Path, old: str, new: str, problems_of: Problems) -> None:
    rewrite(campaign_folder, (old, new))
    assert [p.key for p in problems_of(lambda: load_campaign(campaign_folder))] == ["runs"]


def test_a_missing_campaign_or_vehicle_is_reported(
    campaign_folder: Path, tmp_path: Path, problems_of: Problems
) -> None:
    rewrite(campaign_folder, ("vehicle: vehicle.yaml", "vehicle: vehicel.yaml"))
    assert problems_of(lambda: load_campaign(campaign_folder))[0].remedy == "did you mean 'vehicle.yaml'?"
    assert "cannot be read" in problems_of(lambda: load_campaign(tmp_path / "nowhere"))[0].message


@pytest.fixture
def rig_folder(campaign_folder: Path) -> Path:
    """A campaign on a test rig, measured in mm and V."""
    (campaign_folder / "vehicle.yaml").write_text(RIG)
    t = np.arange(400) / 100
    for name in ("run_a.csv", "run_b.csv"):
        rows = "\n".join(f"{x:g},{np.sin(x):.6f},{np.cos(9 * x):.6f}" for x in t)
        (campaign_folder / name).write_text(f"t [s],u [V],z [mm]\n{rows}\n")
    rewrite(campaign_folder, ("e1: 0.05 mm, rf: 0.3 mrad/s", "z: 0.01 mm, u: 2 mV"))
    return campaign_folder


def test_a_rig_keeps_its_mass_and_has_no_comparison_band(rig_folder: Path) -> None:
    campaign: Campaign = load_campaign(rig_folder)
    expected = [f"vehicle.rig.{key}" for key in ("stiffness", "damping", "gain", "preload")]
    assert list(campaign.estimated_parameters) == expected
    assert (campaign.band, campaign.cut, campaign.cut_share) == (None, 0.0, 0.02)
    assert campaign.cut_length(50.0) == 1.0


def test_noise_of_a_rig_has_the_units_of_its_run(rig_folder: Path) -> None:
    assert load_campaign(rig_folder).noise == {"z": 0.01, "u": 0.002}


def test_noise_of_a_derivative_has_the_unit_of_the_motion(rig_folder: Path) -> None:
    for name in ("run_a.csv", "run_b.csv"):
        path = rig_folder / name
        path.write_text(path.read_text().replace("u [V]", "az [m/s^2]"))
    rewrite(rig_folder, ("u: 2 mV", "az: 5 mm/s^2"))
    assert load_campaign(rig_folder).noise == pytest.approx({"z": 0.01, "az": 5.0})


def test_noise_of_a_rig_has_no_unit_where_its_column_has_none(rig_folder: Path) -> None:
    for name in ("run_a.csv", "run_b.csv"):
        path = rig_folder / name
        path.write_text(path.read_text().replace("z [mm]", "z"))
    with pytest.raises(FileProblems, match="no header states that of z"):
        load_campaign(rig_folder)
    rewrite(rig_folder, ("z: 0.01 mm", "z: 0.01"))
    assert load_campaign(rig_folder).noise["z"] == 0.01


def test_noise_of_a_bench_without_header_units_is_converted_to_si() -> None:
    findings = Findings("fleet.yaml")
    noise = read_stated_noise({"F": "0.1 kN", "z": "0.01 mm", "vz": 2}, "bench", [], findings)
    assert noise == pytest.approx({"F": 100.0, "z": 1e-5, "vz": 2.0}) and not findings.problems
    read_stated_noise({"F": "0.1 V"}, "bench", [], findings)
    assert [problem.key for problem in findings.problems] == ["noise.F"]


def test_a_component_on_a_bench_is_read_in_si(campaign_folder: Path) -> None:
    (campaign_folder / "vehicle.yaml").write_text("vehicle: {rig: {input: motion, stiffness: 1 kN/m}}\n")
    t = np.arange(400) / 100
    for name, units in (("run_a.csv", ("mm", "N")), ("run_b.csv", ("m", "kN"))):
        rows = "\n".join(f"{x:g},{np.sin(x):.6f},{np.cos(9 * x):.6f}" for x in t)
        (campaign_folder / name).write_text(f"t [s],z [{units[0]}],F [{units[1]}]\n{rows}\n")
    rewrite(campaign_folder, ("e1: 0.05 mm, rf: 0.3 mrad/s", "z: 0.01 mm, F: 2 N"))
    campaign = load_campaign(campaign_folder)
    assert [p.rpartition(".")[2] for p in campaign.estimated_parameters] == ["stiffness", "damping", "preload"]
    assert campaign.noise == pytest.approx({"z": 1e-5, "F": 2.0})
    first, second = read_dataset(campaign).segments
    assert first.channels == ["F"] and "vz" not in first.columns
    assert np.std(second.columns["z"]) == pytest.approx(1e3 * np.std(first.columns["z"]))
    assert np.std(second.columns["F"]) == pytest.approx(1e3 * np.std(first.columns["F"]))


def test_a_component_on_a_bench_has_no_mass(campaign_folder: Path, problems_of: Problems) -> None:
    (campaign_folder / "vehicle.yaml").write_text("vehicle: {rig: {input: motion, mass: 3 kg}}\n")
    problem = problems_of(lambda: load_campaign(campaign_folder))[0]
    assert problem.key == "vehicle.rig.mass" and "leave it out" in problem.remedy


def test_mass_stiffness_damping_and_gain_of_a_rig_are_not_estimated_together(
    rig_folder: Path, problems_of: Problems
) -> None:
    free = "adjust: [vehicle.rig.mass, vehicle.rig.stiffness, vehicle.rig.damping]\n"
    assert load_campaign(rewrite(rig_folder, ("", free))).estimated_parameters[0] == "vehicle.rig.mass"
    rewrite(rig_folder, (free, "adjust: [vehicle.rig]\n"))
    assert "common factor" in problems_of(lambda: load_campaign(rig_folder))[0].message


@pytest.mark.parametrize(
    "name", ["worn_axle_box", "low_adhesion", "nothing_missing", "stiff_friction", "blind_a", "blind_b"]
)
def test_the_shared_campaigns_are_read(shared: Path, name: str) -> None:
    campaign = load_campaign(shared / name)
    assert len(campaign.estimated_parameters) == 17 and len(campaign.runs) == 2 and len(campaign.noise) == 11
    assert campaign.warnings == ()
