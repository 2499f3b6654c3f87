"""Published spectra of track irregularities: one-sided power spectral densities per rad/m."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray

Density = Callable[[FloatArray], FloatArray]
Quantity = Literal["yw", "phiw", "gauge"]

QUANTITIES: Final[tuple[Quantity, ...]] = ("yw", "phiw", "gauge")  # the index is that of the seed
HALF_GAUGE: Final = 0.75  # b [m], half the distance of the contact points, for cross-level in rad


@dataclass(frozen=True)
class Spectrum:
    """Published track spectrum: name, source and a density per quantity (None: not published).

    Densities take W [rad/m] and give m^2/(rad/m), for phiw rad^2/(rad/m), one-sided.
    """

    name: str
    source: str
    yw: Density
    phiw: Density | None = None
    gauge: Density | None = None
    stated_from: float | None = None  # shortest and longest wavelength [m] of the published curve
    stated_to: float | None = None

    def density(self, quantity: Quantity) -> Density | None:
        """Return the density of one quantity, None if it is not published."""
        return {"yw": self.yw, "phiw": self.phiw, "gauge": self.gauge}[quantity]


def _erri(name: str, lateral: float, vertical: float) -> Spectrum:
    """Return ERRI B176: lateral and, from the vertical constant, cross-level as an angle."""
    wc2, wr2, ws2 = 0.8246**2, 0.0206**2, 0.4380**2

    def yw(w: FloatArray) -> FloatArray:
        return lateral * wc2 / ((w**2 + wr2) * (w**2 + wc2))

    def phiw(w: FloatArray) -> FloatArray:
        return (vertical / HALF_GAUGE**2) * wc2 * w**2 / ((w**2 + wr2) * (w**2 + wc2) * (w**2 + ws2))

    source = (
        "ERRI B176, Wc 0.8246, Wr 0.0206, Ws 0.4380 rad/m, "
        f"A lateral {lateral:g}, vertical {vertical:g} m^2 rad/m, "
        f"cross-level (A_v/b^2) Wc^2 W^2/((W^2+Wr^2)(W^2+Wc^2)(W^2+Ws^2)) with b {HALF_GAUGE:g} m"
    )
    return Spectrum(name, source, yw, phiw)


def _fra(number: int, lateral: float, vertical: float, ws: float) -> Spectrum:
    """Return FRA class 1 to 6: constants in cm^2 rad/m, cross-level as a height over 2 b."""
    k, wc2 = 0.25, 0.8245**2

    def yw(w: FloatArray) -> FloatArray:
        return k * lateral * 1e-4 * wc2 / (w**2 * (w**2 + wc2))

    def gauge(w: FloatArray) -> FloatArray:
        return 4 * k * vertical * 1e-4 * wc2 / ((w**2 + wc2) * (w**2 + ws**2))

    def phiw(w: FloatArray) -> FloatArray:
        return gauge(w) / (2 * HALF_GAUGE) ** 2

    source = (
        f"FRA class {number}, k 0.25, Wc 0.8245, Ws {ws:g} rad/m, A_a {lateral:g}, A_v {vertical:g} "
        f"cm^2 rad/m, cross-level height over 2 b with b {HALF_GAUGE:g} m"
    )
    return Spectrum(f"fra_{number}", source, yw, phiw, gauge)


def _sncf(name: str, factor: float) -> Spectrum:
    """Return SNCF: S_n(n) = A/(1 + n/n0)^3, taken one-sided per cycle/m and as lateral deviation."""
    a, n0 = factor * 308e-6, 0.0489

    def yw(w: FloatArray) -> FloatArray:
        return a / (1 + w / (2 * np.pi * n0)) ** 3 / (2 * np.pi)

    source = (
        f"SNCF, S_n = A/(1+n/n0)^3, A {factor:g}*308e-6 m^3, n0 0.0489 1/m, taken here as lateral deviation, "
        "one-sided per cycle/m, S(W) = S_n(W/2 pi)/(2 pi) (the literature differs on both)"
    )
    return Spectrum(name, source, yw, stated_from=2.0, stated_to=40.0)


_FRA_LATERAL = (3.3634, 1.2107, 0.4128, 0.3027, 0.0762, 0.0339)
_FRA_VERTICAL = (1.2107, 1.0181, 0.6816, 0.5376, 0.2095, 0.0339)
_FRA_WS = (0.6046, 0.9308, 0.8520, 1.1312, 0.8209, 0.4380)

SPECTRA: Final[dict[str, Spectrum]] = {
    spectrum.name: spectrum
    for spectrum in (
        _erri("erri_b176_low", 2.119e-7, 4.032e-7),
        _erri("erri_b176_high", 6.125e-7, 1.080e-6),
        *(_fra(i + 1, *row) for i, row in enumerate(zip(_FRA_LATERAL, _FRA_VERTICAL, _FRA_WS, strict=True))),
        _sncf("sncf_good", 0.509),
        _sncf("sncf_poor", 1.790),
    )
}


def spectrum_named(name: str) -> Spectrum:
    """Return the spectrum of a name; raise ValueError with the nearest known name.

    >>> spectrum_named("fra_4").name
    'fra_4'
    """
    if name in SPECTRA:
        return SPECTRA[name]
    near = difflib.get_close_matches(name, SPECTRA, n=1, cutoff=0.4)
    hint = f"did you mean {near[0]}? " if near else ""
    raise ValueError(f"no track spectrum {name!r}: {hint}known are {', '.join(SPECTRA)}")


def spectrum_density(name: str, quantity: Quantity, wavenumber: ArrayLike) -> FloatArray:
    """Return the one-sided power spectral density at `wavenumber` [rad/m]: m^2/(rad/m), for phiw rad^2/(rad/m).

    Zero if none is published for the quantity. Raises ValueError for an unknown name or quantity.

    >>> float(spectrum_density("erri_b176_low", "gauge", 1.0))
    0.0
    >>> f"{float(spectrum_density('erri_b176_low', 'yw', 1.0)):.3e}"
    '8.573e-08'
    """
    w = np.asarray(wavenumber, dtype=np.float64)
    if quantity not in QUANTITIES:
        raise ValueError(f"no track quantity {quantity!r}: known are {', '.join(QUANTITIES)}")
    density = spectrum_named(name).density(quantity)
    return np.zeros_like(w) if density is None else np.asarray(density(w), dtype=np.float64)


def spectrum_sd(name: str, quantity: Quantity, shortest: float, longest: float) -> float:
    """Return the standard deviation [m, rad] of a spectrum between two wavelengths [m].

    >>> round(1e3 * spectrum_sd("erri_b176_low", "yw", 3, 25), 3)
    0.714
    """
    if not 0 < shortest < longest:
        raise ValueError(f"a band runs from a shorter to a longer wavelength: {shortest:g} to {longest:g} m")
    from scipy.integrate import quad

    low, high = 2 * np.pi / longest, 2 * np.pi / shortest

    def per_logarithm(u: float) -> float:  # S falls over decades: ln W distributes it evenly
        return float(spectrum_density(name, quantity, np.exp(u)) * np.exp(u))

    variance = quad(per_logarithm, np.log(low), np.log(high), epsabs=0.0, epsrel=1e-10)[0]
    return float(np.sqrt(variance))
