"""Evidence whether a residual is noise: its coherence with the track, the motions and the other channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui.campaign.comparison import compared_channels
from railui.campaign.segment import Segment
from railui.campaign.settings.verdict import VerdictSettings
from railui.identification.context import Context
from railui.identification.estimation.validation import predict_each
from railui.identification.prediction import Prediction
from railui.identification.residual.coherence import ResidualCoherence, Share, residual_coherence
from railui.identification.residual.free_decay import share_at_harmonics
from railui.identification.residual.input_noise import input_noise_spectra
from railui.identification.residual.input_noise_share import input_noise_shares, without_input_noise
from railui.identification.residual.mains_hum import without_hum
from railui.identification.residual.restoring_force_surface import SurfaceShares, surface_shares
from railui.identification.residual.track_noise_coherence import without_track_noise
from railui.identification.residual.vibration import vibration_frequency, vibration_share
from railui.parallel import map_threads
from railui.vehicle.model import Model


@dataclass(frozen=True)
class ResidualEvidence:
    """Coherence of the residual with the track and the motions, in the channel where it is largest.

    Attributes
    ----------
    share
        Of the power of the residual, beyond chance; NaN: the runs are too short.
    channel
        Where it is largest; None: not computed.
    is_coherent
        Whether the share is large, and clear of its standard error.
    is_shared
        Whether the residuals of different channels are coherent: an unmeasured force, or noise of the track.
    is_noise
        Whether the residual is incoherent with track, motions and other channels although one of these, or the
        harmonics of a free motion, could show otherwise, on a rig no vibration and on a bench no function of
        displacement and velocity together.
    surface
        Shares of the residual force of a component on a bench over displacement and velocity; None: not computed.
    vibration
        Frequency [Hz] about which the residual of a rig vibrates; None: about none.
    """

    share: float
    channel: str | None
    is_coherent: bool
    is_shared: bool
    is_noise: bool
    surface: SurfaceShares | None = None
    vibration: float | None = None


NOT_EXAMINED = ResidualEvidence(float("nan"), None, False, False, False)


def examine_residual(context: Context, model: Model) -> ResidualEvidence:
    """Compute the coherence of the residual of a model, on the runs that select effects."""
    settings, segments = context.settings.verdict, context.dataset.selection
    evidence = examine_residual_of_each(context, [(model, s) for s in segments])
    if not all(s.kind == "bench" for s in context.dataset.segments):
        return evidence
    surface = surface_shares(model, context.dataset.estimation, segments)
    return replace(evidence, surface=surface, is_noise=evidence.is_noise and not depends_on_both(settings, surface))


def examine_residual_of_each(context: Context, models: Sequence[tuple[Model, Segment]]) -> ResidualEvidence:
    """Compute the coherence of the residual of models, each on its segment; its surface is not computed."""
    settings, segments = context.settings.verdict, [s for _, s in models]
    predictions = predict_each(context, models)
    predictions = [without_hum(p, context.dataset.hum) if p.diverged_at is None else p for p in predictions]
    coherence = residual_coherence(context, predictions)
    if _has_evidence(settings, coherence):
        coherence = _without_noise_of_inputs(context, models, predictions, coherence)
    has_reference = any(
        len(compared_channels(s)) > 1 or s.kind != "rig" or np.any(s.columns.get("u", 0.0)) for s in segments
    )
    if not has_reference:  # a single channel of a rig that swings freely
        lines = share_at_harmonics(predictions, settings.coherence_standard_errors)
        has_reference = bool(np.isfinite(lines.share)) and not _is_evident(settings, lines)
    vibration = _vibration(context, models, predictions) if all(s.kind == "rig" for s in segments) else None
    evidence = summarise_coherence(settings, coherence, has_reference=has_reference and vibration is None)
    return replace(evidence, vibration=vibration)


def _without_noise_of_inputs(
    context: Context,
    models: Sequence[tuple[Model, Segment]],
    predictions: Sequence[Prediction],
    coherence: dict[str, ResidualCoherence],
) -> dict[str, ResidualCoherence]:
    """Return the coherence less what noise of the track record, or of the input of a rig, leaves."""
    if all(s.is_rig for _, s in models):
        return without_input_noise(coherence, input_noise_shares(context, [m for m, _ in models], predictions))
    return without_track_noise(context, models, predictions, coherence)


def summarise_coherence(
    settings: VerdictSettings, coherence: Mapping[str, ResidualCoherence], *, has_reference: bool
) -> ResidualEvidence:
    """Summarise the coherence of all channels.

    has_reference: another channel or an input was measured, and the spectrum is not that of a vibration.
    """
    shares = [(s, name) for name, c in coherence.items() for s in (c.track, c.motions) if np.isfinite(s.share)]
    if not shares:
        return NOT_EXAMINED
    evident = [(s, name) for s, name in shares if _is_evident(settings, s)]
    largest, channel = max(evident or shares, key=lambda item: item[0].share)
    is_shared = any(_is_evident(settings, c.others) for c in coherence.values())
    is_noise = has_reference and not evident and not is_shared
    return ResidualEvidence(largest.share, channel, bool(evident), is_shared, is_noise)


def _has_evidence(settings: VerdictSettings, coherence: Mapping[str, ResidualCoherence]) -> bool:
    """True where the residual of a channel is coherent with something."""
    return any(_is_evident(settings, s) for c in coherence.values() for s in (c.track, c.motions, c.others))


def _vibration(
    context: Context, models: Sequence[tuple[Model, Segment]], predictions: Sequence[Prediction]
) -> float | None:
    """Frequency [Hz] of a vibration of the residual that noise of the measured input does not explain; None: none."""
    settings = context.settings.verdict
    if not is_vibration(settings, vibration_share(settings, predictions)):
        return None
    followed = [pair for pair, p in zip(models, predictions, strict=True) if p.diverged_at is None]
    spectra = map_threads(lambda pair: input_noise_spectra(context, *pair), followed, context.jobs)
    by_segment = {s: each for (_, s), each in zip(followed, spectra, strict=True)}
    if not is_vibration(settings, vibration_share(settings, predictions, by_segment)):
        return None
    return vibration_frequency(predictions)


def is_vibration(settings: VerdictSettings, share: Share) -> bool:
    """True where so much of a residual is about one frequency that it is no noise."""
    errors = settings.coherence_standard_errors
    return share.share >= settings.min_vibration_share and share.is_significant(errors)


def depends_on_both(settings: VerdictSettings, surface: SurfaceShares | None) -> bool:
    """True where a residual force depends on displacement and velocity together, not as a sum of two functions."""
    return surface is not None and surface.interaction >= settings.min_surface_share


def _is_evident(settings: VerdictSettings, s: Share) -> bool:
    """True where a share is large, and clear of its standard error."""
    return s.share >= settings.min_coherent_share and s.is_significant(settings.coherence_standard_errors)
