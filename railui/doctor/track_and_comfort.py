"""Checks of tracks and ride quality: spectra, weightings, the reduced-comfort boundary."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Final

import numpy as np

from railui.core import sosfilt
from railui.doctor.check import Check
from railui.ride_quality.comfort import comfort_time, n_mv, sperling_wz
from railui.ride_quality.weighting import W_D, W_K, comfort_cascades
from railui.track import band_sd, spectrum_density, spectrum_sd, synthetic_track

UNVERIFIED_CONSTANTS: Final = (
    "the formula by hand, its constants not compared with their source: shows typing errors only"
)
ERRI: Final = "ERRI B176; own integration"
BANDS: Final = ((3.0, 25.0), (25.0, 70.0), (70.0, 150.0), (2.0, 100.0))
ERRI_SD: Final = {"low": (0.714, 1.197, 1.539, 1.696), "high": (1.213, 2.035, 2.616, 2.883)}
FRA_LATERAL: Final = (3.3634, 1.2107, 0.4128, 0.3027, 0.0762, 0.0339)  # A_a [cm^2 rad/m], class 1 to 6
FRA_VERTICAL: Final = (1.2107, 1.0181, 0.6816, 0.5376, 0.2095, 0.0339)
FRA_CORNER: Final = (0.6046, 0.9308, 0.8520, 1.1312, 0.8209, 0.4380)  # Ws [rad/m]
W_D_AT: Final = {1.0: 1.011, 2.0: 0.890, 4.0: 0.512, 8.0: 0.253, 16.0: 0.125, 31.5: 0.0632}
W_K_AT: Final = {1.0: 0.482, 4.0: 0.967, 8.0: 1.036, 16.0: 0.768}
STREAMED: Final = (1.0, 2.0, 4.0, 8.0, 16.0)  # Hz
ISO_1974: Final = {24.0: 0.100, 16.0: 0.150, 8.0: 0.224, 4.0: 0.355, 2.5: 0.50, 1.0: 0.85}  # h, m/s^2


def erri_b176() -> Iterator[Check]:
    """Yield lateral standard deviations by band, of the density and of a synthetic track."""
    for name, expected in ERRI_SD.items():
        computed = [1e3 * spectrum_sd(f"erri_b176_{name}", "yw", *band) for band in BANDS]
        bands = ", ".join(f"{low:g}-{high:g}" for low, high in BANDS)
        yield Check(f"ERRI B176 {name}, lateral in {bands} m [mm]", expected, computed, ERRI, 1e-3)
    sd = 1e3 * band_sd(synthetic_track("erri_b176_low", length=10000.0, seed=1), [BANDS[0]])[0]
    yield Check("a synthetic track of it, lateral in 3-25 m [mm]", 0.714, float(sd), ERRI, 5e-3)


def fra() -> Iterator[Check]:
    """Yield FRA classes at the corner wavenumber, by hand: lateral k A_a/(2 Wc^2), gauge 4 k A_v/(2 (Wc^2 + Ws^2))."""
    wc, names = 0.8245, [f"fra_{i}" for i in range(1, 7)]
    lateral = [0.25e-4 * a / (2 * wc**2) for a in FRA_LATERAL]
    gauge = [1e-4 * a / (2 * (wc**2 + ws**2)) for a, ws in zip(FRA_VERTICAL, FRA_CORNER, strict=True)]
    for quantity, expected in (("yw", lateral), ("gauge", gauge), ("phiw", [g / 1.5**2 for g in gauge])):
        computed = [float(spectrum_density(name, quantity, wc)) for name in names]  # type: ignore[arg-type]
        unit = "rad^2/(rad/m)" if quantity == "phiw" else "m^2/(rad/m)"
        title = f"FRA class 1 to 6, {quantity} at {wc} rad/m [{unit}]"
        yield Check(title, expected, computed, UNVERIFIED_CONSTANTS, 1e-9 * max(expected))


def sncf() -> Iterator[Check]:
    """Yield SNCF at n0, by hand: A/8 per cycle/m, over 2 pi per rad/m."""
    w, factors = 2 * np.pi * 0.0489, {"sncf_good": 0.509, "sncf_poor": 1.790}
    expected = [a * 308e-6 / 8 / (2 * np.pi) for a in factors.values()]
    computed = [float(spectrum_density(name, "yw", w)) for name in factors]
    yield Check("SNCF good and poor at n0 [m^2/(rad/m)]", expected, computed, UNVERIFIED_CONSTANTS, 1e-15)


def weightings() -> Iterator[Check]:
    """Yield W_d and W_k of ISO 2631-1:1997."""
    for name, weight, known in (("W_d", W_D, W_D_AT), ("W_k", W_K, W_K_AT)):
        computed = [float(weight.modulus(f)) for f in known]
        title = f"{name} at {', '.join(f'{f:g}' for f in known)} Hz"
        yield Check(title, list(known.values()), computed, "ISO 2631-1:1997, table 3", 1e-3)
    misprint = "ISO 2631-1:1997 (the printed 0.212 is a misprint)"
    yield Check("W_d at 10 Hz", 0.2017, float(W_D.modulus(10.0)), misprint, 5e-5)


def comfort_filters() -> Iterator[Check]:
    """Yield the filters that the score runs, at 400 samples/s: W_d of sines, Sperling's wz, n_mv of EN 12299."""
    rate = 400.0
    point = SimpleNamespace(floor_frequency=1.2, floor_damping=0.2, cushion_frequency=None, cushion_damping=None)
    sections = comfort_cascades(point, 1.0 / rate, floor=False)
    w_d = sections["weighted_acceleration"]
    t = np.arange(0.0, 305.0, 1.0 / rate)
    gains = []
    for f in STREAMED:
        settled = sosfilt(w_d, np.sin(2 * np.pi * f * t[:24000])[None])[0, 12000:]
        gains.append(float(np.sqrt(2.0 * np.mean(settled**2))))
    title = f"W_d as the score filters, 400 samples/s, at {', '.join(f'{f:g}' for f in STREAMED)} Hz"
    yield Check(title, [W_D_AT[f] for f in STREAMED], gains, "ISO 2631-1:1997, table 3", 1.2e-3)
    f, amplitude = 4.0, 0.3
    b = 0.737 * np.sqrt(
        (1.911 * f**2 + (0.25 * f**2) ** 2) / ((1 - 0.277 * f**2) ** 2 + (1.563 * f - 0.0368 * f**3) ** 2)
    )
    settled = sosfilt(sections["wz"], amplitude * np.sin(2 * np.pi * f * t[:24000])[None])[0, 12000:]
    expected = float(4.42 * (amplitude / np.sqrt(2.0) * b) ** 0.3)
    computed = float(sperling_wz(np.sqrt(np.mean(settled**2))))
    yield Check("wz of a sine, amplitude 0.3 m/s^2, at 4 Hz", expected, computed, "Sperling, the formula by hand", 2e-3)
    level = 0.1 * np.sqrt(2.0) * np.sin(2 * np.pi * 2.0 * t)
    blocks = sosfilt(w_d, level[None])[0, 2000:].reshape(-1, 2000)
    computed_n_mv = n_mv(np.sqrt(np.mean(blocks**2, axis=1)))
    source = "EN 12299 with W_d of ISO 2631-1:1997, by hand"
    yield Check("n_mv of 0.1 m/s^2 rms at 2 Hz, 300 s", 6.0 * 0.1 * 0.890, computed_n_mv, source, 2e-3)


def comfort_of_1974() -> Iterator[Check]:
    """Yield the reduced-comfort boundary at 1 to 2 Hz."""
    computed = [float(comfort_time(rms / 3.15)) / 3600 for rms in ISO_1974.values()]
    title = "reduced comfort after [h], at the points of the standard"
    yield Check(title, list(ISO_1974), computed, "ISO 2631 of the 1970s, over 3.15", 1e-9)


GROUPS: Final = (erri_b176, fra, sncf, weightings, comfort_filters, comfort_of_1974)
