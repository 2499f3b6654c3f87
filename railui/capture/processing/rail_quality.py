"""Quality of a reconstructed track: agreement of both wheelsets' reconstructions, by wavelength band."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.align import parabolic_peak
from railui.core import Spline
from railui.dsp.integrate import highpass_gain
from railui.dsp.spectra import coherence, tukey
from railui.track import BANDS
from railui.track.line_geometry import GRAVITY

GRID_SPACING = 0.25  # m
COHERENCE_SEGMENT = 200.0  # m
MIN_COHERENCE = 0.9  # of a valid wavelength
MIN_GAIN = 0.95  # of the high-pass at a valid wavelength
MAX_LAG = 1.0  # m by which the delay may differ from the wheelbase
CROSS_LEVEL_BASE = 1.5  # m, between the running circles
TAPER_LENGTH = 100.0  # m, both ends together


@dataclass(frozen=True, eq=False)
class RailQuality:
    """Comparison of two reconstructions of one track.

    Attributes
    ----------
    bands
        (from, to [m], standard deviation of the mean, rms of the difference [m]); the error of the mean is about
        half the difference.
    wavelength, coherence
        Wavelengths [m] and magnitude-squared coherence [n].
    correlation
        Correlation coefficient.
    lag
        Delay of the second reconstruction beyond the wheelbase 2a [m], by cross-correlation.
    valid
        Range of reliable wavelengths [m], None if there is none.
    roll_share
        Error from a roll that no sensor measures, of the standard deviation in each band; 0 where one does.
    """

    bands: tuple[tuple[float, float, float, float], ...]
    wavelength: FloatArray
    coherence: FloatArray
    correlation: float
    lag: float
    valid: tuple[float, float] | None
    roll_share: tuple[float, ...]

    @property
    def noise(self) -> float | None:
        """Standard deviation [m] of the mean's noise, from the shortest band, which drift does not affect."""
        return self.errors[0] * self.bands[0][2] if self.bands else None

    @property
    def errors(self) -> tuple[float, ...]:
        """Error of the mean of both reconstructions in each band, of its standard deviation there."""
        shares = ((0.5 * difference / sd if sd else 0.0) for _, _, sd, difference in self.bands)
        return tuple(float(np.hypot(*pair)) for pair in zip(shares, self.roll_share, strict=True))


def band_rms(x: FloatArray, spacing: float, low: float, high: float) -> float:
    """Return the rms of a series [n] at wavelengths from low to high [m]; the ends are tapered.

    >>> s = np.arange(8000) * 0.25
    >>> round(band_rms(np.sin(2 * np.pi * s / 20), 0.25, 3, 25), 2)
    0.71
    >>> round(band_rms(np.sin(2 * np.pi * s / 50), 0.25, 3, 25), 2)
    0.0
    """
    window = tukey(x.size, min(1.0, TAPER_LENGTH / (x.size * spacing)))
    lines = np.fft.rfft((x - x.mean()) * window)
    wavenumber = np.fft.rfftfreq(x.size, spacing)
    is_in_band = (wavenumber >= 1 / high) & (wavenumber <= 1 / low)
    return float(np.sqrt(2 * np.sum(np.abs(lines[is_in_band]) ** 2) / x.size / np.sum(window**2)))


def compare_versions(
    first: FloatArray,
    second: FloatArray,
    s: FloatArray,
    shortest: float,
    natural: float,
    speed: float,
    unmeasured_roll_arm: float | None = None,
) -> RailQuality:
    """Compare two reconstructions of one track.

    Parameters
    ----------
    first, second
        Lateral deviations of the leading and the trailing wheelset's reconstruction [n].
    s
        Distance [m], [n].
    shortest
        Shortest wavelength that the reconstruction keeps [m].
    natural
        Natural frequency of its high-pass [Hz].
    speed
        Speed of the vehicle [m/s].
    unmeasured_roll_arm
        Rolling radius [m] if no sensor measures the roll. Both reconstructions then share the error
        (r + g/w^2) phi_w, which their difference cannot show.
    """
    grid = np.arange(s[0], s[-1], GRID_SPACING)
    a = Spline(s, first)(grid)
    b = Spline(s, second)(grid)
    bands = tuple(
        (low, high, band_rms(0.5 * (a + b), GRID_SPACING, low, high), band_rms(a - b, GRID_SPACING, low, high))
        for low, high in BANDS
        if grid.size * GRID_SPACING > 2 * high
    )
    wavenumber, values = coherence(a, b, 1 / GRID_SPACING, min(grid.size, round(COHERENCE_SEGMENT / GRID_SPACING)))
    is_kept = (wavenumber > 0) & (wavenumber <= 1 / shortest)
    wavelength = 1 / wavenumber[is_kept]
    a0 = a - a.mean()
    b0 = b - b.mean()
    correlation = float(a0 @ b0 / np.sqrt((a0 @ a0) * (b0 @ b0)))
    valid = _valid_wavelengths(wavelength, values[is_kept], shortest, speed / limit_frequency(natural))
    shares = tuple(_roll_share(low, high, speed, unmeasured_roll_arm) for low, high, _, _ in bands)
    valid = valid if unmeasured_roll_arm is None else None
    return RailQuality(bands, wavelength, values[is_kept], correlation, _find_lag(a0, b0), valid, shares)


def _roll_share(low: float, high: float, speed: float, arm: float | None) -> float:
    """Return the error (r + g/w^2) phi_w in a band, of the lateral deviation there; 0 if the roll is measured.

    A cross-level as uneven as the alignment is assumed, as the spectra of ERRI B 176 have it within a factor of two.
    """
    if arm is None:
        return 0.0
    w = 2 * np.pi * speed / np.sqrt(low * high)
    return float((arm + GRAVITY / w**2) / CROSS_LEVEL_BASE)


def limit_frequency(natural: float, damping: float = np.sqrt(0.5)) -> float:
    """Return the frequency [Hz] above which the gain of the zero-phase high-pass exceeds `MIN_GAIN`."""
    frequency = natural * np.linspace(1.0, 20.0, 4000)
    return float(frequency[np.argmax(highpass_gain(frequency, natural, damping) >= MIN_GAIN)])


def _find_lag(a: FloatArray, b: FloatArray) -> float:
    """Return the lag of b [m] at the peak of the cross-correlation, between samples by a parabola."""
    reach = round(MAX_LAG / GRID_SPACING)
    inner = a[reach : a.size - reach]
    shifts = range(-reach, reach + 1)
    values = np.array([float(inner @ b[reach + k : a.size - reach + k]) for k in shifts])
    k, offset = parabolic_peak(values)
    return float((k - reach + offset) * GRID_SPACING)


def _valid_wavelengths(
    wavelength: FloatArray, coherence: FloatArray, shortest: float, longest: float
) -> tuple[float, float] | None:
    """Return the widest range of coherent wavelengths between the limits of the filters."""
    is_inside = (wavelength <= longest) & (wavelength >= shortest)
    is_valid = np.concatenate(([False], is_inside & (coherence >= MIN_COHERENCE), [False]))
    edges = np.flatnonzero(np.diff(is_valid.astype(int)))
    if not edges.size:
        return None
    ranges = [(wavelength[b - 1], wavelength[a]) for a, b in edges.reshape(-1, 2)]
    low, high = max(ranges, key=lambda limits: limits[1] / limits[0])
    return float(low), float(high)
