"""Campaigns built of runs, runs built of arrays."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest

import railui
from tests.api.scipy_rig import DAMPING, DECLARED, NOISE, STIFFNESS, UNITS, arrays
from tests.cli.runner import ROOT, document, run

WORN = ROOT / "designs/campaigns/worn_axle_box"


def rig_campaign(directory: Path | None = None) -> railui.Campaign:
    runs = [railui.Run.from_arrays(arrays(seed), units=UNITS, name=f"run {seed}") for seed in (1, 2)]
    design = railui.Design.from_dict({"vehicle": {"rig": DECLARED}})
    paths = ["vehicle.rig.stiffness", "vehicle.rig.damping"]
    return railui.Campaign.from_runs(
        design,
        estimation=runs[0],
        validation=[runs[1]],
        noise={"z": NOISE},
        estimated_parameters=paths,
        directory=directory,
    )


@pytest.fixture(scope="module")
def fit() -> railui.Fit:
    return rig_campaign().adjust()


def test_parameters_of_a_rig_simulated_by_scipy_are_estimated_from_arrays(fit: railui.Fit) -> None:
    truth = {"vehicle.rig.stiffness": STIFFNESS, "vehicle.rig.damping": DAMPING}
    for path, value in truth.items():
        assert fit.estimates[path].value == pytest.approx(value, rel=0.01)
    assert fit.estimates["vehicle.rig.stiffness"].unit == "N/m"
    assert fit.nominal_nrmse > 0.2 > 0.02 > fit.nrmse


def test_a_fit_has_covariance_residuals_candidates_and_noise(fit: railui.Fit) -> None:
    assert fit.covariance.shape == (2, 2) and np.allclose(np.sqrt(np.diag(fit.covariance)), fit.sd)
    assert np.allclose(np.diag(fit.correlation), 1.0)
    low, high = fit.interval("vehicle.rig.stiffness")
    assert low < fit.values[0] < high
    (residual,) = fit.residuals()
    assert residual.channels == ("z",) and residual.units == {"z": "m"} and residual.role == "validation"
    assert residual["z"] == pytest.approx(residual.measured[0] - residual.simulated[0])
    assert residual.nrmse["z"] == pytest.approx(fit.nrmse)
    assert residual["z"].std() == pytest.approx(NOISE, rel=0.2)
    assert fit.noise_model["z"] == pytest.approx(NOISE, rel=0.2)
    assert {"free_play", "dry_friction"} <= {candidate.kind for candidate in fit.candidates}
    assert abs(fit.candidates[0].rho) < 0.3, "nothing is missing"
    assert fit.design.value("vehicle.rig.stiffness") == fit.values[0]


def test_the_residual_of_each_role_is_that_of_its_runs(fit: railui.Fit) -> None:
    assert [one.file for one in fit.residuals("estimation")] == ["run_1.csv.gz"]
    assert [one.file for one in fit.residuals("validation")] == ["run_2.csv.gz"]
    with pytest.raises(ValueError, match="no role 'adjust'"):
        fit.residuals("adjust")
    with pytest.raises(KeyError, match="did you mean 'z'"):
        fit.residuals()[0]["Z"]


def test_a_named_directory_has_the_files_of_the_same_campaign(tmp_path: Path, fit: railui.Fit) -> None:
    campaign = rig_campaign(tmp_path / "rig")
    assert sorted(path.name for path in (tmp_path / "rig").iterdir()) == [
        "campaign.yaml",
        "run_1.csv.gz",
        "run_2.csv.gz",
        "vehicle.yaml",
    ]
    assert campaign.check() == ()
    printed = document(run("adjust", str(tmp_path / "rig"), "-q", "--json", "-"))
    assert printed["parameters"] == fit.to_dict()["parameters"]
    assert printed["after"] == fit.to_dict()["after"] and printed.keys() == fit.to_dict().keys()
    with pytest.raises(railui.FileProblems, match="exists and is not overwritten"):
        rig_campaign(tmp_path / "rig")


def test_a_faulty_campaign_leaves_its_directory_free_for_the_corrected_one(tmp_path: Path) -> None:
    good = railui.Run.load(WORN / "run_a.csv.gz"), railui.Run.load(WORN / "run_b.csv.gz")
    with pytest.raises(railui.FileProblems, match="lower limit 40 Hz is not below"):
        railui.Campaign.from_runs(
            WORN / "vehicle.yaml", estimation=good[0], validation=good[1], band=(40.0, 0.3), directory=tmp_path / "x"
        )
    campaign = railui.Campaign.from_runs(
        WORN / "vehicle.yaml", estimation=good[0], validation=good[1], directory=tmp_path / "x"
    )
    assert [entry.file.resolve() for entry in campaign.runs] == [WORN / "run_a.csv.gz", WORN / "run_b.csv.gz"]


def test_the_files_without_a_directory_are_removed_with_the_campaign() -> None:
    campaign = rig_campaign()
    home = campaign.directory
    assert (home / "campaign.yaml").exists()
    del campaign
    gc.collect()
    assert not home.exists()


def test_a_campaign_of_arrays_has_the_data_of_the_files_that_they_came_from() -> None:
    files = railui.Campaign.load(WORN)
    runs = [railui.Run.from_arrays(run.columns, name=run.file.name) for run in files.dataset.runs]
    built = railui.Campaign.from_runs(files.design, estimation=runs[0], validation=runs[1], noise=files.noise)
    assert built.noise_model == files.noise_model
    for one, other in zip(built.dataset.segments, files.dataset.segments, strict=True):
        assert one.role == other.role
        for name in other.columns:
            assert np.array_equal(one.columns[name], other.columns[name])


def test_conditions_of_runs_reach_the_campaign() -> None:
    runs = [railui.Run.from_arrays(arrays(seed), conditions={"load": f"{seed} kN"}) for seed in (1, 2)]
    design = railui.Design.from_dict({"vehicle": {"rig": DECLARED}})
    campaign = railui.Campaign.from_runs(design, estimation=runs[:1], validation=runs[1:])
    assert [dict(entry.conditions) for entry in campaign.runs] == [{"load": "1 kN"}, {"load": "2 kN"}]
    assert [entry.name for entry in campaign.runs] == ["run.csv.gz", "run_2.csv.gz"]


def test_a_loop_on_arrays_names_the_noise_and_can_be_saved(tmp_path: Path) -> None:
    loop = rig_campaign().loop()
    assert loop.verdict == "none" and loop.effects == ()
    assert loop.nrmse == pytest.approx(loop.noise_floor, rel=0.2)
    assert loop.to_dict()["schema"] == "railui.loop/1"
    assert loop.candidates[0].kind == "none" or loop.candidates[0].weight is not None
    assert loop.fit.estimates["vehicle.rig.stiffness"].value == pytest.approx(STIFFNESS, rel=0.01)
    assert "no unmodelled effect" in loop.summary().lower()
    written = {path.name for path in loop.save(tmp_path / "loop").iterdir()}
    assert {"loop.json", "report.html", "adjusted.yaml"} <= written
    later = rig_campaign().with_prior(tmp_path / "loop")
    assert isinstance(later, railui.Campaign) and isinstance(later.design, railui.Design)
    assert later.design.value("vehicle.rig.stiffness") == loop.fit.estimates["vehicle.rig.stiffness"].value


def test_a_loop_that_a_data_fault_stops_has_no_fit() -> None:
    runs = railui.Campaign.load(WORN).dataset.runs
    wrong = {**runs[1].columns, "ay1": -runs[1].columns["ay1"]}
    built = [railui.Run.from_arrays(runs[0].columns, name="a"), railui.Run.from_arrays(wrong, name="b")]
    loop = railui.Campaign.from_runs(WORN / "vehicle.yaml", estimation=built[0], validation=built[1]).loop()
    assert loop.verdict == "data" and "ay1" in loop.sentence and loop.nrmse is None
    assert loop.summary().startswith("loop of campaign: data")
    with pytest.raises(RuntimeError, match="stopped before any fit"):
        _ = loop.fit
