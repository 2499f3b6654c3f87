"""Signs and units of channels by comparison with the nominal model, where no kinematic relation determines them.

At wavelengths far above those of the vehicle's own motion every body follows the track, independently of suspension
and contact. There, and there only, a measured channel must have the sign and about the size of the simulated one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.faults.families import discrete_hypotheses
from railui.campaign.faults.hypotheses import Hypothesis
from railui.campaign.segment import Segment
from railui.dsp.spectra import csd, welch
from railui.runs.columns import is_compared
from railui.vehicle.model import Model

LONG_WAVELENGTH = 28.0  # m, from which on the vehicle follows the track
MIN_FREQUENCY = 0.4  # Hz
WINDOW_SECONDS = 5.12
MAX_DURATION = 60.0  # s of a segment that are simulated
MIN_FREQUENCIES = 3
UNIT_TOLERANCE = 1.6  # factor between a unit's gain and that of the channel
MIN_UNIT_GAIN = 6.0


@dataclass(frozen=True)
class ModelAgreement:
    """Correlation of a channel with its simulation, -1 to 1, and its gain over it, at long wavelengths."""

    channel: str
    correlation: float
    gain: float


def compare_with_nominal(model: Model, segment: Segment, channels: Sequence[str]) -> list[ModelAgreement]:
    """Compare channels with the nominal model on a segment; empty where it diverges or the segment is too short."""
    names = [c for c in channels if is_compared(c)]
    part = segment.truncated(min(segment.samples, round(MAX_DURATION / segment.dt)))
    length = round(WINDOW_SECONDS / segment.dt)
    if not names or part.samples < 3 * length:
        return []
    vehicles = model.vehicles(segment.coach_forces)
    model = model.on_segment(*segment.segment_key)
    steps = vehicles.required_steps(model.single_batch(), *segment.speeds, segment.dt)[0]
    table = part.table(model.wheelset_spacing(), steps)
    series, diverged = vehicles.simulate(model.single_batch(), table, segment.dt, steps, names, jobs=1)
    if diverged[0] >= 0:
        return []
    return [_agreement(c, x, part.columns[c], part, length) for c, x in zip(names, series[0], strict=True)]


def _agreement(channel: str, simulated: FloatArray, measured: FloatArray, part: Segment, length: int) -> ModelAgreement:
    rate = 1.0 / part.dt
    f, cross = csd(simulated, measured, rate, length, "line")
    used = (f >= MIN_FREQUENCY) & (f <= part.mean_speed / LONG_WAVELENGTH)
    if used.sum() < MIN_FREQUENCIES:
        return ModelAgreement(channel, 0.0, 1.0)
    own, other = (welch(x, rate, length, "line")[1][used] for x in (simulated, measured))
    weight = 1.0 / np.maximum(own, 1e-300)  # every frequency counts alike
    norm = float(np.sqrt(np.sum(weight * own) * np.sum(weight * other)))
    correlation = float(np.sum(weight * np.real(cross[used]))) / max(norm, 1e-300)
    return ModelAgreement(channel, correlation, float(np.sqrt(np.sum(weight * other) / np.sum(weight * own))))


def contradicted(agreement: ModelAgreement, threshold: float) -> Hypothesis | None:
    """Return the fault of a channel that its simulation contradicts clearly: the opposite sign, or another unit."""
    if agreement.correlation < -threshold and 1.0 / MIN_UNIT_GAIN < agreement.gain < MIN_UNIT_GAIN:
        return Hypothesis("sign", (agreement.channel,), -1.0)
    if agreement.correlation < threshold or 1.0 / MIN_UNIT_GAIN < agreement.gain < MIN_UNIT_GAIN:
        return None
    units = [h for h in discrete_hypotheses([agreement.channel]) if h.kind == "unit"]
    nearest = min(units, key=lambda h: abs(np.log(h.value / agreement.gain)))
    return nearest if abs(np.log(nearest.value / agreement.gain)) < np.log(UNIT_TOLERANCE) else None
