"""Synthetic track: a sum of harmonics with the amplitudes of a published spectrum and seeded phases."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railui.arrays import FloatArray
from railui.core import Spline
from railui.track.line import Track
from railui.track.spectra import QUANTITIES, Quantity, Spectrum, spectrum_density, spectrum_named

EASE_IN_LENGTH = 2.56  # m, the wheelbase 2 a of the bogie of the check values
MAX_SAMPLES = 20_000_000
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(mm|km|m|)")
_METRES = {"": 1.0, "m": 1.0, "mm": 1e-3, "km": 1e3}


@dataclass(frozen=True)
class TrackSpec:
    """Specification of a synthetic track: lengths and wavelengths in m, `scale` multiplies every amplitude.

    Raises ValueError with every value that is out of range.

    >>> str(TrackSpec("fra_4", length=2000.0))
    'fra_4 length=2000 seed=0 spacing=0.1 shortest=3 longest=150 scale=1'
    """

    name: str
    length: float = 1000.0
    seed: int = 0
    spacing: float = 0.1
    shortest: float = 3.0
    longest: float = 150.0
    scale: float = 1.0

    def __post_init__(self) -> None:
        spectrum_named(self.name)
        problems = _problems(self)
        if problems:
            raise ValueError(f"track {self.name}: " + "; ".join(problems))
        object.__setattr__(self, "seed", int(self.seed))

    def __str__(self) -> str:
        lengths = ("length", "spacing", "shortest", "longest", "scale")
        values = {key: f"{getattr(self, key):.15g}" for key in lengths} | {"seed": str(self.seed)}
        return " ".join([self.name, *(f"{field.name}={values[field.name]}" for field in fields(self)[1:])])

    def build(self, ease_in: float = EASE_IN_LENGTH) -> Track:
        """Return the track; its irregularities rise from zero over `ease_in` [m] (the wheelbase 2 a)."""
        return _build(self, ease_in)


def _problems(spec: TrackSpec) -> list[str]:
    """Return the faults of the values of a specification, each with its remedy."""
    numbers = (spec.length, spec.spacing, spec.shortest, spec.longest, spec.scale)
    if not np.all(np.isfinite(numbers)):
        return ["every value must be finite"]
    faults = []
    if not 0.05 <= spec.spacing <= 1:
        faults.append(f"spacing={spec.spacing:g} m is outside 0.05 to 1 m")
    if spec.length <= 0:
        faults.append(f"length={spec.length:g} m must be positive")
    elif spec.spacing > 0:
        count = spec.length / spec.spacing
        if count > MAX_SAMPLES + 0.5:
            return [*faults, f"length={spec.length:g} m makes {count:g} samples: 4 to {MAX_SAMPLES:,} are possible"]
        whole = max(round(count), 1)
        if abs(count - whole) > 1e-6 * count:
            near = int(count) * spec.spacing
            faults.append(
                f"length={spec.length:g} m is not a whole number of spacings of {spec.spacing:g} m: "
                f"take length={near:.10g} or {near + spec.spacing:.10g}"
            )
        elif whole < 4:
            faults.append(f"length={spec.length:g} m makes {whole} samples: 4 to {MAX_SAMPLES:,} are possible")
    if not 0 < spec.shortest < spec.longest:
        faults.append(f"shortest={spec.shortest:g} m must be positive and below longest={spec.longest:g} m")
    elif spec.shortest < 2 * spec.spacing:
        faults.append(f"shortest={spec.shortest:g} m needs spacing={spec.shortest / 2:g} or less")
    elif spec.length > 0 and not _harmonics(spec).size:
        band = f"{spec.shortest:g} to {spec.longest:g} m"
        faults.append(f"no wavelength {spec.length:g}/k m lies in {band}: take a greater length")
    if not 0 <= spec.seed < math.inf or int(spec.seed) != spec.seed:
        faults.append(f"seed={spec.seed:g} must be a whole number from 0")
    if spec.scale < 0:
        faults.append(f"scale={spec.scale:g} must not be negative")
    return faults


def _harmonics(spec: TrackSpec) -> NDArray[np.int64]:
    """Return the numbers k of the harmonics 2 pi k/length inside the band, its ends included."""
    first = max(1, int(np.ceil(spec.length / spec.longest * (1 - 1e-12))))
    last = int(np.floor(spec.length / spec.shortest * (1 + 1e-12)))
    return np.arange(first, last + 1)


def parse_spec(text: str) -> TrackSpec:
    """Parse "erri_b176_low length=2000 seed=1 spacing=0.1 shortest=3 longest=150 scale=1".

    All but the name may be left out; a length may carry mm, m or km. Raises ValueError with the nearest key
    or name and with every value that is out of range.

    >>> parse_spec("erri_b176_low length=2km seed=1").length
    2000.0
    """
    words = text.split()
    if not words:
        raise ValueError('an empty track spec: write for example "erri_b176_low length=2000 seed=1"')
    spectrum_named(words[0])
    keys = [field.name for field in fields(TrackSpec)[1:]]
    values: dict[str, float] = {}
    for word in words[1:]:
        key, _, number = word.partition("=")
        if key not in keys:
            near = difflib.get_close_matches(key, keys, n=1, cutoff=0.0)[0]
            raise ValueError(f"track spec: no key {key!r}, did you mean {near}? keys are {', '.join(keys)}")
        if key in values:
            raise ValueError(f"track spec: {key} is given twice")
        match = _NUMBER.fullmatch(number)
        if match is None or (match[2] and key in ("seed", "scale")):
            what = {"seed": "a whole number", "scale": "a number"}.get(key, "a number in m")
            raise ValueError(f"track spec: {word!r} should read {key}=VALUE, {what}")
        value = float(match[1]) * _METRES[match[2]]
        # a seed may have more digits than a double holds
        values[key] = int(number) if key == "seed" and number.isdecimal() else value
    return TrackSpec(words[0], **values)  # type: ignore[arg-type]


def synthetic_track(
    name: str,
    length: float = 1000.0,
    seed: int = 0,
    spacing: float = 0.1,
    shortest: float = 3.0,
    longest: float = 150.0,
    scale: float = 1.0,
    *,
    ease_in: float = EASE_IN_LENGTH,
) -> Track:
    """Generate a track with a published spectrum.

    A sum of harmonics W_k = 2 pi k/length between two wavelengths, of amplitude sqrt(2 S(W_k) 2 pi/length) times
    `scale` and phases from PCG64(SeedSequence([seed, quantity])), quantity 0 yw, 1 phiw, 2 gauge. A quantity without a
    spectrum is zero, as the conventions of the track state.

    Parameters
    ----------
    name : str
        Name of the spectrum.
    length, spacing : float
        Length and spacing of the samples [m]; length/spacing samples from s = 0.
    seed : int
        Seed of the phases.
    shortest, longest : float
        Band of wavelengths [m].
    scale : float
        Factor of every amplitude.
    ease_in : float
        Length [m] over which the irregularities rise along a half cosine.

    Raises
    ------
    ValueError
        For an unknown name (with the nearest) and for values out of range.

    Examples
    --------
    >>> track = synthetic_track("erri_b176_low", length=2000.0, seed=1)
    >>> len(track), track.spacing, float(abs(track.yw[0])), float(abs(track.gauge).max())
    (20000, 0.1, 0.0, 0.0)
    """
    return TrackSpec(name, length, seed, spacing, shortest, longest, scale).build(ease_in)


def _build(spec: TrackSpec, ease_in: float) -> Track:
    if not 0 <= ease_in < np.inf:
        raise ValueError(f"ease_in={ease_in:g} m must be zero or positive: it is the wheelbase 2 a")
    s = spec.spacing * np.arange(round(spec.length / spec.spacing))
    rise = np.ones_like(s) if ease_in == 0 else 0.5 * (1 - np.cos(np.pi * np.minimum(s / ease_in, 1.0)))
    columns = {quantity: rise * _sum_of_harmonics(spec, quantity, s.size) for quantity in QUANTITIES}
    return Track(s, **columns, conventions=_conventions(spec, ease_in), is_synthetic=True)


def _sum_of_harmonics(spec: TrackSpec, quantity: Quantity, samples: int) -> FloatArray:
    """Return the sum over k of amplitude cos(W_k s + phase), by the inverse Fourier transform."""
    k = _harmonics(spec)
    spacing_w = 2 * np.pi / spec.length
    amplitude = spec.scale * np.sqrt(2 * spectrum_density(spec.name, quantity, spacing_w * k) * spacing_w)
    seed = np.random.SeedSequence([spec.seed, QUANTITIES.index(quantity)])
    # drawn from k = 1 on, so that a harmonic keeps its phase when the band changes
    phase = np.random.Generator(np.random.PCG64(seed)).uniform(0.0, 2 * np.pi, int(k[-1]))[k - 1]
    line = np.zeros(samples // 2 + 1, dtype=np.complex128)
    line[k] = 0.5 * samples * amplitude * np.exp(1j * phase)
    if 2 * k[-1] == samples:  # at the Nyquist wavelength the transform counts a line once
        line[k[-1]] *= 2
    return np.fft.irfft(line, samples)


def _conventions(spec: TrackSpec, ease_in: float) -> tuple[str, ...]:
    """Return the header of a synthetic track: spectrum, sides and variable, band, seed."""
    spectrum = spectrum_named(spec.name)
    absent = [quantity for quantity in QUANTITIES if spectrum.density(quantity) is None]
    lines = [
        f"synthetic track: {spec}",
        f"spectrum: {spectrum.source}",
        "power spectral densities are one-sided, per rad/m: S(W) [m^2/(rad/m)], cross-level [rad^2/(rad/m)]",
        f"band: wavelengths {spec.shortest:g} to {spec.longest:g} m{_beyond(spec, spectrum)}",
        f"harmonics W_k = 2 pi k/{spec.length:g} m, amplitude {spec.scale:g} sqrt(2 S dW), "
        f"phases PCG64(SeedSequence([{spec.seed}, quantity])), quantity 0 yw, 1 phiw, 2 gauge",
        f"eased in over the first {ease_in:g} m by a half cosine",
    ]
    return (*lines, *(f"{quantity} is zero: this family states no spectrum for it" for quantity in absent))


def _beyond(spec: TrackSpec, spectrum: Spectrum) -> str:
    """Return a remark if the band exceeds the wavelengths of the published spectrum."""
    if spectrum.stated_from is None or spectrum.stated_to is None:
        return ""
    if spec.shortest >= spectrum.stated_from and spec.longest <= spectrum.stated_to:
        return ""
    return f" (stated for {spectrum.stated_from:g} to {spectrum.stated_to:g} m only: continued beyond)"


def band_limited_noise(rng: np.random.Generator, s: ArrayLike, sd: float, shortest_wavelength: float) -> FloatArray:
    """Generate Gaussian noise at locations `s` [m] with a flat spectrum above a wavelength [m] and none below.

    Shape of s, which need be neither even nor increasing; `sd` is the standard deviation of the process, about which
    that of a record scatters. Raises ValueError for a wavelength that is not positive or a negative sd.

    >>> noise = band_limited_noise(np.random.default_rng(0), np.arange(0, 5000, 0.2), 2e-5, 2.5)
    >>> noise.shape, bool(1.9e-5 < noise.std() < 2.1e-5)
    ((25000,), True)
    """
    if not (shortest_wavelength > 0 and sd >= 0):
        raise ValueError(f"noise needs a wavelength > 0 and sd >= 0: {shortest_wavelength:g} m, sd {sd:g}")
    location = np.asarray(s, dtype=np.float64)
    if location.size == 0:
        return np.zeros_like(location)
    start, extent = float(location.min()), float(np.ptp(location))
    step = shortest_wavelength / 10  # ten points per wave: the error of the spline between them is 1e-3
    # a period longer than the record, else its ends would be correlated
    samples = int(np.ceil(max(1.25 * extent, 20 * shortest_wavelength) / step)) + 4
    last = int(samples * step / shortest_wavelength)
    line = np.zeros(samples // 2 + 1, dtype=np.complex128)
    parts = rng.standard_normal((2, last)) * (sd * 0.5 * samples / np.sqrt(last))
    line[1 : last + 1] = parts[0] + 1j * parts[1]
    grid = start + step * np.arange(samples)
    return Spline(grid, np.fft.irfft(line, samples))(location)
