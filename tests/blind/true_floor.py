"""Noise floor of a simulated campaign from what its generator added, where no model of the loop is the true one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from railui.campaign.comparison import compare, nrmse, overall_nrmse
from railui.campaign.noise.model import ColumnNoise, NoiseModel
from railui.campaign.noise.spectrum import NoiseSpectrum
from railui.campaign.segment import TRACK_COLUMNS, Segment
from railui.identification.context import Context
from railui.identification.estimation.noise_floor import estimate_noise_floor
from railui.vehicle.model import Model
from tests.truth.files import NOISE
from tests.truth.laws import Array

Columns = Mapping[str, Array]


def true_noise_floor(context: Context, model: Model, clean: Mapping[str, Columns]) -> float:
    """NRMSE on the validation runs that the noise of sensors and track leaves.

    Sensors: the recorded less the clean channels. Track: a model near the true one on tracks with the true noise.

    clean: columns without noise of every run, by its letter.
    """
    campaign, segments = context.campaign, context.dataset.validation
    sensors = overall_nrmse(nrmse([compare(campaign, s, _clean_series(clean, s)) for s in segments]))
    levels = {c: NOISE[c][0] for c in TRACK_COLUMNS if c in NOISE}
    track = {c: ColumnNoise(sd, NoiseSpectrum(sd)) for c, sd in levels.items()}
    columns = {c: n for c, n in context.noise.columns.items() if c not in TRACK_COLUMNS}
    context = replace(context, dataset=replace(context.dataset, noise=NoiseModel({**columns, **track})))
    floor = estimate_noise_floor(context, model, segments)
    return float(np.sqrt(sensors**2 + floor.nrmse**2 - floor.sensors_only**2))


def _clean_series(clean: Mapping[str, Columns], segment: Segment) -> Array:
    """Clean channels [channel, n] of a segment."""
    run = clean[segment.file.removeprefix("run_")[0]]
    rows = np.searchsorted(run["t"], segment.columns["t"] - 1e-6)
    return np.stack([run[c][rows] for c in segment.channels])
