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
from railui.campaign.settings.faults import FaultSettings
from railui.dsp.spectra import csd, welch
from railui.runs.columns import is_compared
from railui.vehicle.model import Model

WINDOW_SECONDS = 5.12


@dataclass(frozen=True)
class ModelAgreement:
    """Correlation of a channel with its simulation, -1 to 1, and its gain over it, at long wavelengths."""

    channel: str
    correlation: float
    gain: float


def compare_with_nominal(
    model: Model, segment: Segment, channels: Sequence[str], settings: FaultSettings
) -> list[ModelAgreement]:
    """Compare channels with the nominal model on a segment; empty where it diverges or the segment is too short."""
    names = [c for c in channels if is_compared(c)]
    part = segment.truncated(min(segment.samples, round(settings.nominal_duration / segment.dt)))
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
    return [_agreement(c, x, part, length, settings) for c, x in zip(names, series[0], strict=True)]


def _agreement(
    channel: str, simulated: FloatArray, part: Segment, length: int, settings: FaultSettings
) -> ModelAgreement:
    measured, rate = part.columns[channel], 1.0 / part.dt
    f, cross = csd(simulated, measured, rate, length, "line")
    used = (f >= settings.min_following_frequency) & (f <= part.mean_speed / settings.following_wavelength)
    if used.sum() < settings.min_following_lines:
        return ModelAgreement(channel, 0.0, 1.0)
    own, other = (welch(x, rate, length, "line")[1][used] for x in (simulated, measured))
    weight = 1.0 / np.maximum(own, 1e-300)  # every frequency counts alike
    norm = float(np.sqrt(np.sum(weight * own) * np.sum(weight * other)))
    correlation = float(np.sum(weight * np.real(cross[used]))) / max(norm, 1e-300)
    return ModelAgreement(channel, correlation, float(np.sqrt(np.sum(weight * other) / np.sum(weight * own))))


def contradicted(agreement: ModelAgreement, settings: FaultSettings) -> Hypothesis | None:
    """Return the fault of a channel that its simulation contradicts clearly: the opposite sign, or another unit."""
    threshold, gain = settings.opposed_correlation, settings.min_unit_gain
    if agreement.correlation < -threshold and 1.0 / gain < agreement.gain < gain:
        return Hypothesis("sign", (agreement.channel,), -1.0)
    if agreement.correlation < threshold or 1.0 / gain < agreement.gain < gain:
        return None
    units = [h for h in discrete_hypotheses([agreement.channel]) if h.kind == "unit"]
    nearest = min(units, key=lambda h: abs(np.log(h.value / agreement.gain)))
    return nearest if abs(np.log(nearest.value / agreement.gain)) < np.log(settings.unit_tolerance) else None
