"""Identification of one simulated campaign with growing sets of sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from railui.campaign.dataset import Dataset
from railui.campaign.noise.estimate import estimate_noise_model
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.identifiability import Identifiability, analyse_identifiability
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.estimation.validation import validate
from railui.identification.structure.candidate_scores import run_score_test
from railui.identification.structure.gain_forecast import predict_validation_gain
from railui.identification.structure.minimum_detectable import minimum_detectable_effects
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.unmodelled.run_dependence import prepare_validation
from railui.runs.columns import column_names
from railui.vehicle.track_geometry import track_geometry

SENSOR_SETS: tuple[tuple[str, ...], ...] = (
    ("ayf",),
    ("ayf", "rf"),
    ("ay1", "ay2", "ayf"),
    ("ay1", "ay2", "ayf", "rf"),
    ("ay1", "ay2", "ayf", "rf", "d1", "d2"),
    ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2"),
)


@dataclass(frozen=True, eq=False)
class Identified:
    """Calibration and score test of a campaign without an unmodelled effect, from some channels.

    Attributes
    ----------
    error
        NRMSE on the validation runs.
    detectable, significant
        Rows of the minimum detectable effects: as the loop states them, and by the score test alone, without a minimum
        gain on the validation runs.
    """

    channels: tuple[str, ...]
    context: Context
    fit: Fit
    error: float
    floor: NoiseFloor
    score_test: ScoreTestResult
    detectable: list[dict[str, Any]]
    significant: list[dict[str, Any]]
    identifiability: Identifiability


def with_channels(dataset: Dataset, channels: Sequence[str]) -> Dataset:
    """Keep some responses of a dataset and estimate the noise from what is left, as if no other had been recorded."""
    dropped = set(column_names("bogie", "response")) - set(channels)
    segments = tuple(
        replace(s, columns={k: x for k, x in s.columns.items() if k not in dropped}, tables={})
        for s in dataset.segments
    )
    campaign = dataset.campaign
    stated = {k: x for k, x in campaign.noise.items() if k not in dropped}
    noise = estimate_noise_model(
        segments, stated, track_geometry(campaign.design), campaign.band, campaign.noise_band, campaign.settings.noise
    )
    return replace(dataset, segments=segments, noise=noise)


def identify(dataset: Dataset, channels: tuple[str, ...], jobs: int | None = None) -> Identified:
    """Calibrate from some channels, score every candidate effect, and compute the minimum detectable effects."""
    context = create_context(with_channels(dataset, channels), jobs=jobs)
    fit = calibrate(context)
    error = validate(context, fit.model, context.dataset.validation).nrmse
    scores = run_score_test(context, fit)
    gains = predict_validation_gain(context, prepare_validation(context, fit), scores)
    return Identified(
        channels,
        context,
        fit,
        error,
        estimate_noise_floor(context, fit.model, context.dataset.validation),
        scores,
        minimum_detectable_effects(scores, context.campaign.min_relative_gain, error, gains),
        minimum_detectable_effects(scores, 0.0, error, {}),
        analyse_identifiability(fit, context.settings.identifiability),
    )
