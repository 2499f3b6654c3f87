"""Priors of the numbers that a fit of a vehicle of bodies moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.segment import Segment
from railui.identification.context import Context, create_context
from railui.identification.estimation.free_parameters import free_parameters
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.unbiased import with_unbiased_estimates
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model
from tests.blind.simulated import simulated_campaign

DESIGNS = Path(__file__).parents[3] / "designs"
CLEARANCE, FORCE = "effects.1.clearance", "effects.2.force"


def context_of(name: str) -> Context:
    return create_context(read_dataset(load_campaign(DESIGNS / "campaigns" / name)))


def test_an_effect_of_the_nominal_coach_has_a_prior_and_an_added_one_has_none() -> None:
    context = context_of("worn_centre_guide")
    friction = PlacedEffect("dry_friction", "secondary_lateral", None, {"force": 300.0, "slip_speed": 0.01})
    nominal = context.nominal.design
    model = Model(nominal.with_effects([*nominal.effects, friction]))
    moved = Model(model.design.with_values({CLEARANCE: 0.02}))
    free = free_parameters(context, moved, [CLEARANCE, FORCE])
    assert free.paths == (CLEARANCE, FORCE)
    assert free.prior[0] == nominal.value(CLEARANCE) and 0 < free.prior_sd[0] < nominal.value(CLEARANCE)
    assert np.isinf(free.prior_sd[1])


LATERAL_DAMPING, YAW_DAMPING = "vehicle.secondary.lateral_damping", "vehicle.secondary.yaw_damping"
CARBODY = PlacedEffect("coach_mode", "secondary_lateral", None, {"mass": 7e3, "stiffness": 4e5, "damping": 3e4})


def estimated(context: Context, model: Model) -> tuple[float, float]:
    """Value and standard deviation of the lateral damping, estimated with that of yaw and without its bias."""
    fit = with_unbiased_estimates(context, fit_output_error(context, model, [LATERAL_DAMPING, YAW_DAMPING]))
    return float(fit.x[0]), float(fit.sd[0])


@pytest.mark.parametrize("defaulted", [frozenset[str](), frozenset({"stiffness", "damping"})])
def test_a_number_that_an_effect_replaces_keeps_its_nominal_value(defaulted: frozenset[str]) -> None:
    """It moves nothing: without a prior its standard deviation was 1e140, and its last step led to a bound."""
    context = simulated_campaign().context
    nominal, carbody = context.nominal.value(LATERAL_DAMPING), replace(CARBODY, defaulted=defaulted)
    assert estimated(context, context.nominal.with_effect(carbody)) == pytest.approx((nominal, 0.5 * nominal), rel=1e-6)


def test_a_number_next_to_a_measured_force_keeps_its_nominal_value() -> None:
    context = simulated_campaign().context

    def driven(segment: Segment) -> Segment:
        force = np.sin(segment.columns["t"])
        return replace(segment, columns={**segment.columns, "Qy": force}, tables={})

    segments = tuple(driven(s) for s in context.dataset.segments)
    context = replace(context, dataset=replace(context.dataset, segments=segments))
    nominal = context.nominal.value(LATERAL_DAMPING)
    assert estimated(context, context.nominal) == pytest.approx((nominal, 0.5 * nominal), rel=1e-6)
