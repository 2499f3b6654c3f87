"""Bound of the sensor noise by the residual: noise that a model cannot predict is part of what the model leaves.

The top of a spectrum, from which noise is estimated, may be motion: harmonics of a stop, or the answer of a mass to a
broadband force. A model that follows the data better than that noise permits shows it.
"""

from __future__ import annotations

from dataclasses import replace

from railui.campaign.noise.model import ESTIMATED
from railui.identification.context import Context
from railui.identification.estimation.noise_floor import sensor_noise_errors
from railui.identification.estimation.validation import Validation


def with_noise_within_residual(context: Context, validation: Validation) -> Context:
    """Return the context with the noise of each channel at most the residual of a model.

    validation: of the model on the runs that select effects. The stated noise of a column is not changed, nor a level
    within its uncertainty.
    """
    noise, limit = context.noise, context.settings.noise.max_noise_over_residual
    expected = sensor_noise_errors(context, context.dataset.selection)
    factors = {
        c: validation.channels[c] / error
        for c, error in expected.items()
        if error > limit * validation.channels.get(c, float("inf")) > 0.0 and noise.columns[c].source == ESTIMATED
    }
    if not factors:
        return context
    names = ", ".join(f"{c} by {1.0 / x:.2g}" for c, x in factors.items())
    context.progress.message(f"noise estimated from the runs exceeds the residual, to which it is lowered: {names}")
    return replace(context, dataset=replace(context.dataset, noise=noise.within_residual(factors)))
