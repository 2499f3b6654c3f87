"""Gains that the data checks state: a model without them contradicts those that are none."""

from __future__ import annotations

from dataclasses import replace

import pytest

from railui.campaign.finding import Finding
from railui.campaign.segment import Segment
from railui.identification.residual.withdrawn_gains import contradicted_gains
from railui.vehicle.effects import PlacedEffect
from tests.blind.simulated import calibrated, simulated_campaign

CHANNEL = "e2"


def stated(gain: float, *, serious: bool = False) -> Finding:
    files = ", ".join(dict.fromkeys(s.file for s in simulated_campaign().dataset.segments))
    return Finding("gain", files, CHANNEL, gain, "1", "e2 is recorded too large", serious)


@pytest.mark.parametrize(
    ("recorded", "gain", "is_serious", "is_withdrawn"),
    [
        (1.0, 0.909, False, True),
        (0.909, 0.909, False, False),
        (0.95, 0.909, False, False),  # about as near to one as to the stated gain
        (1.0, 0.909, True, False),
        (1.0, 0.999, False, False),  # nearer to one than the data tell
    ],
)
def test_a_gain_is_withdrawn_where_the_model_fits_the_channel_without_it(
    recorded: float, gain: float, is_serious: bool, is_withdrawn: bool
) -> None:
    context, model, finding = simulated_campaign().context, calibrated().model, stated(gain, serious=is_serious)

    def with_gain(segment: Segment) -> Segment:
        return replace(segment, columns={**segment.columns, CHANNEL: recorded * segment.columns[CHANNEL]}, tables={})

    dataset = replace(context.dataset, segments=tuple(with_gain(s) for s in context.dataset.segments))
    found = contradicted_gains(replace(context, dataset=dataset), model, [finding])
    assert found == ((finding,) if is_withdrawn else ())


def test_a_gain_that_is_an_effect_of_the_model_stands() -> None:
    model = calibrated().model.with_effect(PlacedEffect("sensor_gain", CHANNEL, None, {"gain": 1.0}))
    assert contradicted_gains(simulated_campaign().context, model, [stated(0.909)]) == ()
