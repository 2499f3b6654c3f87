"""Multiple coherence of the channels with the track under all wheelsets: the limit of any linear model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.finding import Finding
from railui.campaign.segment import Segment
from railui.dsp.spectra import detrend, hann
from railui.runs.columns import is_compared
from railui.vehicle.track_geometry import TrackGeometry

SPECTRUM_SECONDS = 5.12  # window of the spectra
BAND = (0.5, 12.0)  # Hz
MIN_AVERAGES_PER_INPUT = 4
MIN_WINDOWS = 10  # in the length of a segment, without overlap


def coherence_limits(segment: Segment, geometry: TrackGeometry) -> list[Finding]:
    """Compute the lowest NRMSE of each channel that a linear vehicle can reach with the measured track as its input.

    The limit is sqrt(1 - multiple coherence) over the band. Nonlinear effects, unmeasured forces, noise and a varying
    speed raise it.

    Parameters
    ----------
    segment
        A segment of a run of a vehicle on a track.
    geometry
        Of its wheelsets on the track.

    Returns
    -------
    list of Finding
        One per compared channel, `value` its lowest NRMSE; empty if the segment is too short for the average.
    """
    columns, s = segment.columns, segment.columns["s"]
    track = [columns[name] for name in ("yw", "phiw") if np.any(columns.get(name, np.zeros(1)))]
    if not track:  # a free motion follows no track
        return []
    inputs = geometry.under_wheelsets(s, track)
    length = min(round(SPECTRUM_SECONDS / segment.dt), segment.samples // MIN_WINDOWS)
    f, x = _transforms(inputs, segment.dt, length)
    in_band = (f >= BAND[0]) & (f <= BAND[1])
    averages = x.shape[1]
    if averages < MIN_AVERAGES_PER_INPUT * len(inputs):
        return []
    sxx = np.einsum("isf,jsf->fij", x.conj(), x)[in_band]
    findings = []
    for name in segment.channels:
        if not is_compared(name):
            continue
        y = _transforms([columns[name]], segment.dt, length)[1][0]
        sxy = np.einsum("isf,sf->fi", x.conj(), y)[in_band]
        syy = np.sum(np.abs(y) ** 2, axis=0)[in_band]
        coherent = np.real(np.einsum("fi,fi->f", sxy.conj(), np.linalg.solve(sxx, sxy[..., None])[..., 0]))
        incoherent = np.clip((syy - coherent) * averages / max(averages - len(inputs), 1), 0.0, None)
        limit = float(np.sqrt(min(incoherent.sum() / syy.sum(), 1.0)))
        causes = "nonlinear, unmeasured, noise, varying speed"
        text = f"{name}: a share of {limit:.2f} is not coherent with the track ({causes})"
        findings.append(Finding("ceiling", segment.file, name, limit, "1", text))
    return findings


def _transforms(columns: Sequence[FloatArray], dt: float, length: int) -> tuple[FloatArray, ComplexArray]:
    """Frequencies [Hz] and windowed transforms [column, window, frequency] of half-overlapping windows."""
    window = hann(length)
    starts = range(0, len(columns[0]) - length + 1, length // 2)
    parts = [[np.fft.rfft(detrend(x[k : k + length]) * window) for k in starts] for x in columns]
    return np.asarray(np.fft.rfftfreq(length, dt), dtype=np.float64), np.array(parts)
