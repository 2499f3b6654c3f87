"""Validation of a parameter that varies along the track: phases of rotating parts, divergence."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from railui.identification.estimation.fit import Fit
from railui.identification.estimation.validation import validate
from railui.identification.structure.drift import Drift, _limits, validate_drift
from railui.vehicle.design_reader import PlacedEffect
from tests.blind.simulated import simulated_campaign

STIFFNESS = "vehicle.primary.lateral_stiffness"
RUN_OUT = {"force": 2500.0, "rolling_radius": 0.4613}


def constant(value: float) -> Drift:
    """A drift that stays at one value."""
    return Drift(STIFFNESS, {STIFFNESS: 1.0}, np.array([0.0, 1e4]), np.array([value, value]), np.zeros(2), 0.0)


def test_a_constant_parameter_validates_as_the_model_does_with_the_phases_of_its_rotating_parts():
    case = simulated_campaign(f"run_out at=wheelset wheelset=1 force={RUN_OUT['force']} rolling_radius=0.4613")
    model = case.nominal.with_effect(PlacedEffect("run_out", "wheelset", 1, RUN_OUT), {})
    segments = case.dataset.validation
    plain = validate(case.context, model, segments)
    varying = validate_drift(case.context, model, constant(model.value(STIFFNESS)), segments)
    assert varying.nrmse == pytest.approx(plain.nrmse, rel=1e-6)


def test_a_parameter_calibrated_to_zero_may_drift_to_either_side() -> None:
    free = SimpleNamespace(paths=[STIFFNESS], low=np.array([-50.0]), high=np.array([100.0]))
    fit = cast(Fit, SimpleNamespace(free=free, x=np.zeros(1)))
    assert _limits(simulated_campaign().context, fit, STIFFNESS) == (-50.0, 100.0)


@pytest.mark.parametrize(("constant", "limits"), [(10.0, (1.0, 100.0)), (-10.0, (-100.0, -1.0))])
def test_a_tenth_of_a_drifting_parameter_remains_whatever_its_sign(constant: float, limits: tuple[float, float]):
    free = SimpleNamespace(paths=[STIFFNESS], low=np.array([-100.0]), high=np.array([100.0]))
    fit = cast(Fit, SimpleNamespace(free=free, x=np.array([constant])))
    assert _limits(simulated_campaign().context, fit, STIFFNESS) == pytest.approx(limits)


def test_a_vehicle_that_diverges_on_the_way_has_an_undefined_error():
    case = simulated_campaign()
    drift = Drift("contact.leading.conicity", {"contact.leading.conicity": 1.0, "contact.trailing.conicity": 1.0},
                  np.array([0.0, 1e4]), np.array([5.0, 5.0]), np.zeros(2), 0.0)  # fmt: skip
    found = validate_drift(case.context, case.nominal, drift, case.dataset.validation)
    assert np.isnan(found.nrmse) and found.diverged[0][0] == case.dataset.validation[0].file
