"""Candidates: those that effects of the model compose already are none."""

from __future__ import annotations

import pytest

from railui.identification.structure.candidates import list_candidates
from railui.vehicle.effects import PlacedEffect
from tests.blind.simulated import simulated_campaign

NUMBERS = {"force": 1e3, "rolling_radius": 0.46}


@pytest.mark.parametrize(
    ("present", "left"),
    [((), {None, 1, 2}), ((1,), {None, 2}), ((1, 2), set()), ((None, 1), set())],
)
def test_a_run_out_of_both_wheelsets_is_the_sum_of_those_of_each(
    present: tuple[int | None, ...], left: set[int | None]
) -> None:
    context = simulated_campaign().context
    model = context.nominal
    for wheelset in present:
        model = model.with_effect(PlacedEffect("run_out", "wheelset", wheelset, NUMBERS))
    found = list_candidates(model, context.dataset.estimation)
    assert {c.wheelset for c in found if c.kind == "run_out"} == left
    assert {c.wheelset for c in found if c.kind == "dry_friction" and c.at == "primary_lateral"} == {None, 1, 2}
