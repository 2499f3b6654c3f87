"""Gauss-Newton steps along a direction that the data hardly determine."""

from __future__ import annotations

from pathlib import Path

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.context import create_context
from railui.identification.estimation.calibration import calibrate
from tests.identification.test_loop_on_roller_rig import DECAYS
from tests.truth.roller_rig import Order, write_campaign


def test_creep_and_gravitational_stiffness_are_separated_by_decays_alone(tmp_path: Path) -> None:
    """With sensitivities of few steps the iteration ended at a lateral creep coefficient of 182 +/- 35, true: 131."""
    rig = write_campaign(Order(33, DECAYS), tmp_path)
    fit = calibrate(create_context(read_dataset(load_campaign(tmp_path)), jobs=1))
    assert fit.status == "converged"
    for name, true in (("lateral_creep", rig.kappa_y), ("longitudinal_creep", rig.kappa_x)):
        j = fit.free.paths.index(f"contact.wheels.{name}")
        assert fit.sd[j] < 0.03 * true
        assert abs(fit.x[j] - true) < 3.0 * fit.sd[j]
