"""Gains of sensors that the data checks state and the final model contradicts.

The checks relate the channels by kinematics and a linear vehicle before any fit. What they do not know, such as a rail
that yields under the wheelset, may look like a gain; a model that contains it needs none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.finding import Finding
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.block_ratio import ratio_standard_error
from railui.identification.estimation.validation import error_block_duration, predict_each
from railui.identification.prediction import SimulationError
from railui.vehicle.model import Model

GAIN_EFFECT = "sensor_gain"


def contradicted_gains(context: Context, model: Model, findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the findings of a gain that the channel has not by a model: it is nearer to one than to the stated value.

    A gain with its standard errors has to be nearer, on the runs of the finding. A gain that is an effect of the model
    stands, and so does a serious finding.
    """
    of_model = {sensor.at for sensor in model.sensors if sensor.kind == GAIN_EFFECT}
    return tuple(
        f
        for f in findings
        if f.check == "gain" and not f.serious and f.channel not in of_model and _is_contradicted(context, model, f)
    )


def _is_contradicted(context: Context, model: Model, finding: Finding) -> bool:
    dataset, files = context.dataset, finding.file.split(", ")
    segments = [
        s for s in (*dataset.estimation, *dataset.validation) if s.file in files and finding.channel in s.columns
    ]
    estimate = _gain(context, model, segments, finding.channel or "")
    if estimate is None:
        return False
    gain, standard_error = estimate
    margin = context.settings.verdict.location_standard_errors * standard_error
    return abs(gain - 1.0) + margin < 0.5 * abs(finding.value - 1.0)


def _gain(context: Context, model: Model, segments: Sequence[Segment], channel: str) -> tuple[float, float] | None:
    """Regress a measured channel on the simulated one; return the gain and its standard error over blocks of time.

    None where there is no such channel, or the vehicle diverges.
    """
    products, squares = list[FloatArray](), list[FloatArray]()
    duration = error_block_duration(context, segments)
    try:
        predictions = predict_each(context, [(model, segment) for segment in segments])
    except SimulationError:
        return None
    for prediction in predictions:
        compared = prediction.comparison
        if channel not in compared.channels or prediction.diverged_at is not None:
            return None
        row = list(compared.channels).index(channel)
        y, x = compared.measured[row], compared.simulated[row]
        starts = np.arange(0, len(x), max(1, round(duration / compared.dt)))
        products.append(np.add.reduceat(x * y, starts))
        squares.append(np.add.reduceat(x * x, starts))
    if not products:
        return None
    product, square = np.concatenate(products), np.concatenate(squares)
    if not square.sum() > 0.0:
        return None
    return float(product.sum() / square.sum()), ratio_standard_error(product, square)
