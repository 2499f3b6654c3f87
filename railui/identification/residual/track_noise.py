"""Noise of the track columns from what a model leaves, where it is neither stated closely nor given by relations.

It moves the wheelsets as forces at the contact do. A residual that such forces explain, whatever their course, and no
law, is that of noise of the track columns: the data do not distinguish the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from railui.campaign.noise.estimate import independent_rail_levels
from railui.campaign.noise.model import BOTH, ESTIMATED, ColumnNoise, NoiseModel
from railui.campaign.noise.spectrum import NoiseSpectrum
from railui.campaign.segment import TRACK_COLUMNS
from railui.identification.context import Context
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.estimation.validation import Validation
from railui.vehicle.model import Model
from railui.vehicle.track_geometry import track_geometry


def with_track_noise(context: Context, model: Model, validation: Validation, floor: NoiseFloor) -> Context | None:
    """Return the context with so much track noise that it leaves the error of a validation.

    The excess of the squared floor over that of the sensors grows as the squared level. What is left bounds the level
    from above, however closely a higher one was stated.

    Parameters
    ----------
    validation
        Of the model on the runs that select effects.
    floor
        Noise floor there.

    Returns
    -------
    Context or None
        None where the level would lie above the known one by more than the uncertainty of both, without a known one
        above a share of the alignment, or where the errors of the channels are not in the proportions that noise of
        the track leaves.
    """
    noise, is_known = context.noise, True
    if not any(noise.get(c, 0.0) > 0.0 for c in TRACK_COLUMNS):
        noise, is_known = _assumed(context), False
        if not noise:
            return None
        draws = context.settings.validation.preliminary_floor_draws
        floor = estimate_noise_floor(_with(context, noise), model, context.dataset.selection, draws)
    excess = floor.nrmse**2 - floor.sensors_only**2
    if excess <= 0.0 or not validation.nrmse > floor.sensors_only:
        return None
    factor = float(np.sqrt((validation.nrmse**2 - floor.sensors_only**2) / excess))
    if not is_known and noise["yw"] * factor > context.settings.noise.max_rail_noise_share * _alignment(context):
        return None
    level = _scaled(context, noise, factor, 0.0)
    floor = estimate_noise_floor(_with(context, level), model, context.dataset.selection)
    scatter = _scatter_of_level(context, floor)
    if is_known and factor > _largest_factor(context, scatter):
        return None
    if not _has_proportions(context, validation, floor):
        return None
    return _with(context, _scaled(context, noise, factor, scatter))


def _scatter_of_level(context: Context, floor: NoiseFloor) -> float:
    """Standard deviation of the logarithm of the level with which a floor is e^2 = s^2 + level^2 t^2.

    The error of one realisation scatters as those of the floor do: d ln(level) = e de / (e^2 - s^2). It is at most that
    of a stated level, where noise of the sensors alone is nearly as large.
    """
    excess = floor.nrmse**2 - floor.sensors_only**2
    most = float(np.log(context.settings.noise.stated_noise_factor))
    return min(floor.nrmse * float(np.nan_to_num(floor.sd)) / excess, most) if excess > 0.0 else most


def _has_proportions(context: Context, validation: Validation, floor: NoiseFloor) -> bool:
    """True where no channel has an error far above or far below that of noise.

    Noise of the track moves all channels: one that follows the model better than such noise allows speaks against it.
    """
    ratios = np.array([validation.channels[c] / floor.channels[c] for c in floor.channels])
    limit = context.settings.selection.unexplained_ratio
    return bool(np.max(ratios) <= limit and np.min(ratios) >= 1.0 / limit)


def with_level_of_residual(context: Context, model: Model, validation: Validation, floor: NoiseFloor) -> Context:
    """Return the context with the track noise that the residual of a model shows, where it is not known closely.

    The bias of the estimates grows as its square: without rail positions, a level stated too low by three leaves most.
    Parameters as for `with_track_noise`.
    """
    known = [context.noise.log_sd(c) for c in TRACK_COLUMNS if context.noise.get(c, 0.0) > 0.0]
    if known and max(known) <= np.log(context.settings.noise.quiet_noise_factor):
        return context
    found = with_track_noise(context, model, validation, floor)
    return context if found is None else found


def _largest_factor(context: Context, scatter: float) -> float:
    """Factor on the known level of the track noise up to which one from the residual, with its scatter, is believed."""
    standard_errors = context.settings.verdict.location_standard_errors
    known = max((context.noise.log_sd(c) for c in TRACK_COLUMNS), default=0.0)
    return float(np.exp(standard_errors * np.hypot(known, scatter)))


def _assumed(context: Context) -> NoiseModel:
    """Noise model with independent errors of both rails; empty where no track was measured, or it was without noise."""
    segments = context.dataset.selection
    present = {c for c in TRACK_COLUMNS if any(np.any(s.columns.get(c, 0.0)) for s in segments)}
    if "yw" not in present or any(c in context.noise for c in TRACK_COLUMNS):
        return NoiseModel()
    yw = context.settings.noise.rail_noise_share * _alignment(context)
    levels = independent_rail_levels(yw, track_geometry(context.nominal.design).half_gauge)
    unstated = {c: ColumnNoise(levels[c], NoiseSpectrum(levels[c]), source=ESTIMATED) for c in levels if c in present}
    return NoiseModel({**context.noise.columns, **unstated})


def _alignment(context: Context) -> float:
    """Standard deviation [m] of the recorded alignment, median over the segments that select effects."""
    return float(np.median([np.std(s.columns["yw"]) for s in context.dataset.selection]))


def _scaled(context: Context, noise: NoiseModel, factor: float, scatter: float) -> NoiseModel:
    """Noise model with the track noise times a factor, of which the logarithm has a standard deviation."""
    log_sd = float(np.hypot(np.log(context.settings.noise.quiet_noise_factor), scatter))
    columns = dict(noise.columns)
    for name in TRACK_COLUMNS:
        if (c := columns.get(name)) is not None and c.used > 0.0:
            used, source = factor * c.used, ESTIMATED if c.stated is None else BOTH
            columns[name] = ColumnNoise(used, c.spectrum.scaled(factor), c.stated, used, log_sd, log_sd, source)
    return NoiseModel(columns)


def _with(context: Context, noise: Mapping[str, float]) -> Context:
    return replace(context, dataset=replace(context.dataset, noise=noise))
