"""What of every channel a linear vehicle can follow: multiple coherence with the track under both wheelsets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.consistency import BAND, SEGMENT
from railui.campaign.dataset import COMPARED, Segment
from railui.campaign.finding import Finding
from railui.dsp.spectra import detrend, hann

SLOWEST = 0.5  # Hz from which it is told


def coherence_limits(stretch: Segment, values: Mapping[str, float]) -> list[Finding]:
    """What of every channel a linear vehicle explains from the track under both wheelsets: multiple coherence.

    value: the nrmse that remains; nonlinear effects, unmeasured forces, noise and a speed that varies all add to it.
    """
    c, behind = stretch.columns, 2.0 * values["vehicle.geometry.half_wheelbase"]
    inputs = [c[q] for q in ("yw", "phiw") if np.any(c.get(q, np.zeros(1)))]
    inputs += [np.interp(c["s"] - behind, c["s"], x) for x in inputs]
    n = min(round(2 * SEGMENT / stretch.dt), stretch.samples // 10)
    out = []
    f, x = _spectra(inputs, stretch.dt, n)
    kept = (f >= SLOWEST) & (f <= BAND[1])
    segments = x.shape[1]
    if segments < 4 * len(inputs):
        return []
    sxx = np.einsum("isf,jsf->fij", x.conj(), x)[kept]
    for name in stretch.channels:
        if name not in COMPARED:
            continue
        _, y = _spectra([c[name]], stretch.dt, n)
        sxy = np.einsum("isf,sf->fi", x.conj(), y[0])[kept]
        syy = np.sum(np.abs(y[0]) ** 2, axis=0)[kept]
        explained = np.real(np.einsum("fi,fi->f", sxy.conj(), np.linalg.solve(sxx, sxy[..., None])[..., 0]))
        free = np.clip((syy - explained) * segments / max(segments - len(inputs), 1), 0.0, None)
        rest = float(np.sqrt(min(free.sum() / syy.sum(), 1.0)))
        text = f"{name}: {rest:.2f} of it is not coherent with the track (nonlinear, unmeasured, noise, changing speed)"
        out.append(Finding("ceiling", stretch.file, name, rest, "1", text))
    return out


def _spectra(columns: Sequence[FloatArray], dt: float, n: int) -> tuple[FloatArray, NDArray[np.complex128]]:
    """Windowed transforms [column, segment, frequency] of half-overlapping segments."""
    window = hann(n)
    starts = range(0, len(columns[0]) - n + 1, n // 2)
    parts = [[np.fft.rfft(detrend(x[k : k + n]) * window) for k in starts] for x in columns]
    return np.asarray(np.fft.rfftfreq(n, dt), dtype=np.float64), np.array(parts)
