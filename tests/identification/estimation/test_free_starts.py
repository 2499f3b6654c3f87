"""Initial states of a rig: their sensitivity belongs to one segment and model, and they are eliminated once."""

from __future__ import annotations

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import adapt_to_model, drop_states, truncate
from railui.identification.estimation.unbiased import _joint_products
from railui.vehicle.effects import PlacedEffect
from tests.truth.effects import parse
from tests.truth.rig import Bench, write


@pytest.fixture(scope="module")
def decay(tmp_path_factory: pytest.TempPathFactory) -> tuple[Context, Fit]:
    folder = tmp_path_factory.mktemp("decay")
    write(Bench(seed=5, free=True, seconds=(4.0, 3.0)), folder)
    context = create_context(read_dataset(load_campaign(folder)), jobs=1)
    return context, calibrate(context)


def optimiser_of(context: Context, fit: Fit, segments) -> GaussNewton:
    return GaussNewton.of_fit(context, fit, segments)


def test_the_misfit_of_a_shortened_decay_needs_no_sensitivity_of_the_whole(decay: tuple[Context, Fit]) -> None:
    context, fit = decay
    short = truncate(context, fit.segments, 1.0)
    assert short[0].measured.size < fit.segments[0].measured.size
    (misfit,) = optimiser_of(context, fit, short).misfit(fit.x[None])
    assert misfit == pytest.approx(np.sum((short[0].measured - short[0].predictor(fit.model).simulate()[0][0]) ** 2))


def test_another_model_has_no_sensitivity_of_the_former(decay: tuple[Context, Fit]) -> None:
    context, fit = decay
    assert fit.segments[0].initial_sensitivity is not None
    other = fit.model.with_effect(PlacedEffect("dry_friction", "rig", None, {"force": 1.0, "slip_speed": 0.01}))
    for segments in (
        adapt_to_model(context, other, fit.segments),
        drop_states(context, other, fit.model, fit.segments),
    ):
        assert segments[0].initial_sensitivity is None


def test_the_initial_state_of_a_rig_is_eliminated_once(decay: tuple[Context, Fit]) -> None:
    context, fit = decay
    joint = _joint_products(context, fit, optimiser_of(context, fit, fit.segments))
    assert len(joint.precision) == len(fit.x)


@pytest.mark.parametrize(
    ("law", "start"),
    [
        ("dry_friction at=rig force=100 slip_speed=0.01", {"force": 80.0, "slip_speed": 0.02}),
        ("hysteresis at=rig stiffness=4e4 yield=60", {"stiffness": 3e4, "yield": 50.0}),
    ],
)
def test_a_preload_that_only_shifts_the_motion_is_left_to_its_prior(law: str, start, tmp_path) -> None:
    """With friction the accelerations are the same about any equilibrium, once the initial state is free."""
    effect = parse(law)
    write(Bench([effect], seed=3, columns=("az",), seconds=(8.0, 4.0), rate=200.0, noise=1e-3), tmp_path)
    context = create_context(read_dataset(load_campaign(tmp_path)), jobs=1)
    model = context.nominal.with_effect(PlacedEffect(effect.kind, "rig", None, start))
    fit = fit_output_error(context, model, [*context.campaign.estimated_parameters, *model.effect_paths()])
    j = fit.free.paths.index("vehicle.rig.preload")
    assert fit.sd[j] > 0.99 * fit.free.prior_sd[j]
    assert abs(fit.x[j]) < 0.02 * fit.free.prior_sd[j]
