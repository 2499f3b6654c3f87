"""Clocks that run apart: a delay that grows along the run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railui.campaign.faults.hypotheses import Consistency, Hypothesis
from railui.campaign.settings.faults import FaultSettings

BLOCKS = 5
MIN_BLOCK_WINDOWS = 5
LAG_STEP = 4e-3  # s
MAX_LAG = 0.4  # s
UNKNOWN_LAG = 0.2  # s, where no delay of the whole run is known
REFINEMENTS = 8


def drifting_clock(
    consistency: Consistency, lag: Hypothesis, settings: FaultSettings
) -> tuple[Hypothesis, float, float] | None:
    """Fit a drifting clock to the channels of a delay; return it, its misfit and the standard deviation of its rate.

    None if the run is too short, or a constant delay explains as much.
    """
    spectra = consistency.spectra
    blocks = min(BLOCKS, consistency.windows // MIN_BLOCK_WINDOWS)
    if blocks < 3:
        return None
    rows = np.array_split(np.arange(consistency.windows), blocks)
    centre = lag.value / consistency.speed if lag.kind == "offset" else lag.value
    lags = LAG_STEP * np.arange(-round(MAX_LAG / LAG_STEP), round(MAX_LAG / LAG_STEP) + 1)
    lags = lags[np.abs(lags - centre) <= (max(0.05, 1.5 * abs(centre)) if centre else UNKNOWN_LAG)]
    local, time = [], []
    for part in rows:
        block = Consistency(spectra, slice(int(part[0]), int(part[-1]) + 1))
        misfits = block.misfits([[Hypothesis("delay", lag.channels, float(x))] for x in lags])
        local.append(float(lags[int(np.argmin(misfits))]))
        time.append(float(np.mean(spectra.time[part])))
    rate, delay = np.polyfit(time, local, 1)
    fitted = _refined(consistency, Hypothesis("clock", lag.channels, float(rate), float(delay)))
    drift = abs(fitted[0].value) * float(np.ptp(spectra.time))
    constant = _refined(consistency, Hypothesis("clock", lag.channels, 0.0, float(np.mean(local))), ("delay",))
    is_evident = constant[1] - fitted[1] > settings.min_clock_evidence
    return fitted if drift > settings.min_clock_drift and is_evident else None


def _refined(
    consistency: Consistency, h: Hypothesis, free: Sequence[str] = ("value", "delay")
) -> tuple[Hypothesis, float, float]:
    """Refine rate and initial delay in turn by parabolas."""
    duration = float(np.ptp(consistency.spectra.time))
    steps = {k: x for k, x in (("value", LAG_STEP / duration), ("delay", 0.5 * LAG_STEP)) if k in free}
    misfit, curvature = consistency.clock_misfit(h), 0.0
    for i in range(REFINEMENTS):
        for name, step in steps.items():
            step *= 0.6**i
            centre = getattr(h, name)
            trial = [replace(h, **{name: centre + k * step}) for k in (-1, 1)]
            low, high = (consistency.clock_misfit(x) for x in trial)
            bend = low - 2.0 * misfit + high
            shift = float(np.clip(0.5 * (low - high) / bend, -1.0, 1.0)) if bend > 0 else float(np.sign(low - high))
            moved = replace(h, **{name: centre + shift * step})
            if (value := consistency.clock_misfit(moved)) < misfit:
                h, misfit = moved, value
            if name == "value":
                curvature = bend / step**2
    return h, misfit, float(1.0 / np.sqrt(curvature)) if curvature > 0 else float("nan")
