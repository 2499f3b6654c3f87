"""Validation of models that cannot be simulated."""

from __future__ import annotations

import numpy as np
import pytest

from railui.identification.estimation.validation import is_significant_gain, validate
from railui.identification.prediction import SimulationError
from railui.vehicle.effects import PlacedEffect
from tests.blind.simulated import simulated_campaign

STIFF = PlacedEffect("dry_friction", "primary_yaw", None, {"force": 5e5, "slip_speed": 2e-4})


def test_an_effect_that_is_too_stiff_on_a_validation_run_gains_nothing() -> None:
    context = simulated_campaign().context
    without, with_effect = (
        validate(context, model, context.dataset.validation)
        for model in (context.nominal, context.nominal.with_effect(STIFF))
    )
    assert np.isnan(with_effect.nrmse) and np.isfinite(without.nrmse)
    assert [file for file, _ in with_effect.diverged] == [s.file for s in context.dataset.validation]
    assert not is_significant_gain(context, without, with_effect)


def test_a_vehicle_that_is_too_stiff_itself_is_an_error() -> None:
    context = simulated_campaign().context
    stiff = context.nominal.with_path_values(["vehicle.primary.lateral_stiffness"], np.array([1e13]))
    with pytest.raises(SimulationError, match="steps per sample"):
        validate(context, stiff, context.dataset.validation)
