"""An earlier loop as the prior of a new campaign: vehicle, priors, noise, and refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.prior import with_prior
from railui.documents.saving import save_design
from railui.identification.context import create_context
from railui.identification.estimation.free_parameters import free_parameters
from railui.io.problems import FileProblems
from railui.vehicle.design import Adjustment
from railui.vehicle.effects import PlacedEffect
from tests.truth.campaign import Order, campaign, write

STIFFNESS, CLEARANCE = "vehicle.primary.lateral_stiffness", "effects.0.half_width"


@pytest.fixture(scope="module")
def new(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("new")
    write(campaign(Order(seed=2, seconds=(20.0, 15.0))), folder)
    return folder


def finished_loop(folder: Path, of: Path) -> Path:
    """Write the files of a loop that estimated a stiffness and a clearance."""
    folder.mkdir(exist_ok=True)
    clearance = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 3e-4})
    design = load_campaign(of).design.with_values({STIFFNESS: 2.5e6}).with_effects([clearance])
    covariance = ((4e8, 0.0), (0.0, 1e-12))
    adjustment = Adjustment("spring", "0" * 64, (STIFFNESS, CLEARANCE), covariance)
    save_design(replace(design, adjustment=adjustment), folder / "adjusted.yaml")
    noise = {"ayf": {"used": 0.07}, "d9": {"used": 1.0}}
    (folder / "loop.json").write_text(json.dumps({"verdict": "effect", "floor": {"noise": noise}}))
    return folder


def test_the_calibrated_vehicle_is_the_nominal_one(new: Path, tmp_path: Path) -> None:
    found = with_prior(load_campaign(new), finished_loop(tmp_path, new))
    assert found.design.values[STIFFNESS] == 2.5e6
    assert [e.kind for e in found.design.effects] == ["free_play"]
    assert found.estimated_parameters[-1] == CLEARANCE
    assert found.prior is not None and found.prior.sd[STIFFNESS] == pytest.approx(2e4)
    assert found.noise["ayf"] == load_campaign(new).noise["ayf"]  # stated noise counts


def test_the_prior_has_the_spread_of_the_estimate_and_of_the_usual_drift(new: Path, tmp_path: Path) -> None:
    found = with_prior(load_campaign(new), finished_loop(tmp_path, new))
    context = create_context(read_dataset(found))
    free = free_parameters(context, context.nominal, found.estimated_parameters)
    i = free.paths.index(STIFFNESS)
    assert free.prior[i] == 2.5e6
    assert free.prior_sd[i] == pytest.approx(np.hypot(2e4, 0.05 * 2.5e6))
    j = free.paths.index(CLEARANCE)
    assert (free.prior[j], free.prior_sd[j]) == pytest.approx((3e-4, np.hypot(1e-6, 0.05 * 3e-4)))


def test_a_directory_without_a_loop_and_another_vehicle_are_refused(new: Path, tmp_path: Path) -> None:
    with pytest.raises(FileProblems, match=r"has no adjusted\.yaml.*finished loop"):
        with_prior(load_campaign(new), tmp_path)
    rig = load_campaign(Path(__file__).parents[2] / "designs/campaigns/mr_damper")
    with pytest.raises(FileProblems, match="not the vehicle of"):
        with_prior(rig, finished_loop(tmp_path, new))
