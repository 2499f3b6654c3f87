"""Priors of the numbers that a fit of a vehicle of bodies moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.context import Context, create_context
from railui.identification.estimation.free_parameters import free_parameters
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

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
