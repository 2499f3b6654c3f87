"""Noise model of a campaign: per column what was stated, what was estimated, and what the identification uses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.noise.spectrum import NoiseSpectrum
from railui.dsp.filters import frequency_response

FREQUENCIES = 4000  # of the integral of a spectrum
STATED, ESTIMATED, BOTH = "stated", "estimated", "both"


@dataclass(frozen=True)
class ColumnNoise:
    """Noise of a column; levels are standard deviations of white noise with the same power in the compared band.

    Attributes
    ----------
    used
        Level that the identification uses.
    spectrum
        Level and colour used.
    stated, estimated
        Level in the campaign file, and from the data alone; None: not stated, not determined by the data.
    log_sd
        Standard deviation of the natural logarithm of the level used.
    estimated_log_sd
        The same of the estimated one.
    source
        stated, estimated or both.
    excess
        Level estimated from the runs over that used, where the residual of a model bounds it; None: not bounded.
    """

    used: float
    spectrum: NoiseSpectrum
    stated: float | None = None
    estimated: float | None = None
    log_sd: float = 0.0
    estimated_log_sd: float | None = None
    source: str = STATED
    excess: float | None = None

    @property
    def ratio_to_stated(self) -> float | None:
        """Level used over the stated one; None where none, or zero, was stated."""
        return self.used / self.stated if self.stated else None

    @property
    def coloured_share(self) -> float:
        """Share of the variance, over all frequencies, that is not white."""
        coloured = sum(sd**2 for _, sd in self.spectrum.coloured)
        total = coloured + self.spectrum.white**2
        return coloured / total if total > 0.0 else 0.0

    def lowered(self, factor: float) -> ColumnNoise:
        """Return the noise times a factor, by which the residual of a model bounds it."""
        used, excess = factor * self.used, (self.excess or 1.0) / factor
        return replace(self, used=used, spectrum=self.spectrum.scaled(factor), estimated=used, excess=excess)


@dataclass(frozen=True)
class NoiseModel(Mapping[str, float]):
    """Noise of every column; as a mapping, its level used."""

    columns: Mapping[str, ColumnNoise] = field(default_factory=dict)

    def __getitem__(self, name: str) -> float:
        """Level used of a column."""
        return self.columns[name].used

    def __iter__(self) -> Iterator[str]:
        """Names of the columns."""
        return iter(self.columns)

    def __len__(self) -> int:
        """Number of columns."""
        return len(self.columns)

    @property
    def source(self) -> str:
        """Source of the levels together: stated or estimated where all are, else both."""
        sources = {c.source for c in self.columns.values()}
        return sources.pop() if len(sources) == 1 else BOTH if sources else ESTIMATED

    def within_residual(self, factors: Mapping[str, float]) -> NoiseModel:
        """Return the noise model with columns lowered to the residual of a model, by factors on their levels."""
        return NoiseModel({**self.columns, **{name: self.columns[name].lowered(x) for name, x in factors.items()}})

    def log_sd(self, name: str) -> float:
        """Standard deviation of the logarithm of a column's level; 0 without noise."""
        return self.columns[name].log_sd if name in self.columns else 0.0

    def draw(self, channels: Sequence[str], samples: int, dt: float, rng: np.random.Generator) -> FloatArray:
        """Draw sensor noise [channel, n] with the level and colour of each channel."""
        none = NoiseSpectrum(0.0)
        spectra = [self.columns[c].spectrum if c in self.columns else none for c in channels]
        return np.stack([spectrum.draw(rng, samples, dt) for spectrum in spectra])

    def variance(self, channels: Sequence[str], sections: FloatArray, dt: float) -> FloatArray:
        """Variance [channel] of sensor noise after a filter of sections [section, 6], forward and backward."""
        f: FloatArray = np.asarray((np.arange(FREQUENCIES) + 0.5) * (0.5 / dt / FREQUENCIES))
        gain = np.abs(frequency_response(sections, 2.0 * np.pi * f * dt)) ** 4 if len(sections) else np.ones_like(f)
        densities = [self.columns[c].spectrum.density(f, dt) if c in self.columns else 0.0 * f for c in channels]
        return np.asarray(np.stack(densities) @ gain * (0.5 / dt / FREQUENCIES))


def white_noise(levels: Mapping[str, float], source: str = STATED) -> NoiseModel:
    """Noise model of white noise with given standard deviations."""
    return NoiseModel(
        {name: ColumnNoise(sd, NoiseSpectrum(sd), stated=sd, source=source) for name, sd in levels.items()}
    )


def as_noise_model(noise: Mapping[str, float]) -> NoiseModel:
    """Return a noise model as it is, and standard deviations as white noise."""
    return noise if isinstance(noise, NoiseModel) else white_noise(noise)
