"""Estimation of the noise model of a campaign.

Level and colour of a channel come from kinematic relations in which every motion cancels, where the channels satisfy
any, else from the top of its spectrum: white, or flicker noise where the upper half falls as 1/f. What is incoherent
with the track and with all other channels bounds them from above. The stated noise is a log-normal prior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.noise.bounds import TRACK, Level, incoherent_level, is_flat, quiet_band, quiet_level
from railui.campaign.noise.flicker import FlickerNoise, flicker_noise
from railui.campaign.noise.input_noise import input_noise_level
from railui.campaign.noise.model import BOTH, ESTIMATED, STATED, ColumnNoise, NoiseModel
from railui.campaign.noise.record import Record, band_limits
from railui.campaign.noise.relations import RAILS, RelationSpectra, relation_spectra
from railui.campaign.noise.spectrum import NoiseSpectrum, corner_frequencies, markov_density
from railui.campaign.noise.variance_components import (
    COLOURED_START,
    Components,
    Observation,
    estimate_components,
)
from railui.campaign.settings.noise import NoiseSettings
from railui.runs.columns import RIG_FORMS
from railui.vehicle.track_geometry import TrackGeometry

MIN_LEVEL = 1e-12
MAX_BAND_RATIO = 1e3  # upper over lower end of the band in which noise has a colour, where all frequencies count


class NoiseEstimate:
    """Estimation of the noise of all columns from records of one kind of vehicle."""

    def __init__(
        self,
        records: Sequence[Record],
        stated: Mapping[str, float],
        geometry: TrackGeometry,
        band: tuple[float, float] | None,
        noise_band: float,
        settings: NoiseSettings,
    ) -> None:
        self.records = records
        self.stated = stated
        self.geometry = geometry
        self.band = band
        self.noise_band = noise_band
        self.settings = settings
        self.channels = list(dict.fromkeys(c for record in records for c in record.channels))
        self.is_rig = bool(records) and records[0].kind in RIG_FORMS

    @cached_property
    def bounds(self) -> dict[str, float]:
        """Level per response of its part that is incoherent with track and other channels; infinite: unknown."""
        bounds = {}
        for c in self.channels:
            levels = [incoherent_level(r, c, self.geometry, self.band) for r in self.records if c in r.columns]
            known = [x for x in levels if x is not None]
            bounds[c] = float(np.median(known)) if known else np.inf
        return bounds

    def run(self) -> NoiseModel:
        """Estimate the noise of every column."""
        columns = {c: self._single_channel(c) for c in self.channels}
        if self.is_rig:
            columns |= self._rig_input()
        else:
            columns |= self._from_relations(columns)
        columns = {c: self._bounded(c, noise) for c, noise in columns.items()}
        given = {c: self._as_stated(c) for c in self.stated}
        return NoiseModel(given | columns)

    def _as_stated(self, column: str) -> ColumnNoise:
        """Noise of which nothing is known but what was stated, which may be wrong."""
        sd, prior = self.stated.get(column), self._prior(column)
        level = sd or 0.0
        return ColumnNoise(level, NoiseSpectrum(level), sd, log_sd=0.0 if prior is None else prior.sd)

    def _prior(self, channel: str) -> Level | None:
        sd = self.stated.get(channel, 0.0)
        return Level(float(np.log(sd)), float(np.log(self.settings.stated_noise_factor))) if sd > 0.0 else None

    def _single_channel(self, channel: str) -> ColumnNoise:
        """White or flicker noise of a channel from the top of its spectrum and the stated noise."""
        stated = self.stated.get(channel)
        least = float(np.log(self.settings.quiet_noise_factor))
        quiet = quiet_level(self.records, channel, least, self.settings.min_coherent_top)
        if quiet is None:
            return self._as_stated(channel)
        spectrum = NoiseSpectrum(float(np.exp(quiet.log)))
        flicker = self._flicker(channel)
        if flicker is not None:
            spectrum, quiet = self._flicker_spectrum(flicker, quiet.sd)
        level = quiet.combine(self._prior(channel))
        used, source = float(np.exp(level.log)), ESTIMATED if stated is None else BOTH
        alone = float(np.exp(quiet.log))
        return ColumnNoise(used, spectrum.scaled(used / alone), stated, alone, level.sd, quiet.sd, source)

    def _flicker(self, channel: str) -> FlickerNoise | None:
        """Flicker noise of a channel where the upper half of its spectrum is that and no motion; None: none."""
        if self.is_rig or not np.isfinite(self.bounds[channel]):
            return None
        settings, found = self.settings, flicker_noise(self.records, channel)
        is_flicker = (
            found is not None
            and found.z >= settings.min_flicker_z
            and found.share >= settings.min_flicker_share
            and found.deviation <= settings.max_flicker_deviation
        )
        return found if is_flicker else None

    def _flicker_spectrum(self, flicker: FlickerNoise, sd: float) -> tuple[NoiseSpectrum, Level]:
        """Return the spectrum of flicker noise, and the level of white noise of its power in the compared band."""
        dt = self.records[0].dt
        low, high = band_limits(self.band, dt)
        low = max(low, high / MAX_BAND_RATIO)
        spectrum = flicker.spectrum(low, high, dt)
        f = np.linspace(low, high, 1000)
        level = float(np.sqrt(np.mean(spectrum.density(f, dt)) / (2.0 * dt)))
        return spectrum, Level(float(np.log(level)), sd)

    def _rig_input(self) -> dict[str, ColumnNoise]:
        """Noise of the input of a rig: as stated, at most its quiet band; else where it cannot be a drive."""
        if self.records[0].kind == "bench":  # whose motion is smooth
            return {c: self._single_channel(c) for c in ("z", "vz") if any(c in r.columns for r in self.records)}
        if "u" not in self.stated:
            level = input_noise_level(self.records, "u", self.settings)
            return {} if level is None else {"u": _estimated_white(level)}
        stated = self.stated["u"]
        quiet = quiet_level([r for r in self.records if "u" in r.columns], "u", 1e-9)
        if quiet is None or np.exp(quiet.log) >= stated:
            return {"u": self._as_stated("u")}
        used = float(np.exp(quiet.combine(self._prior("u")).log if quiet.sd > 1e-9 else quiet.log))
        return {"u": ColumnNoise(used, NoiseSpectrum(used), stated, used, source=BOTH)}

    def _from_relations(self, single: Mapping[str, ColumnNoise]) -> dict[str, ColumnNoise]:
        """Levels and colours of the channels in kinematic relations, and of the track columns."""
        spectra = relation_spectra(self.records, self.geometry, self.band, self.settings)
        if not spectra:
            return {}
        names = list(dict.fromkeys(c for s in spectra for c, g in s.gains.items() if np.max(np.abs(g)) > 0.0))
        parts = {c: _Parts(self.band, self.noise_band, spectra[0], self.settings, is_rails=c == RAILS) for c in names}
        prior = {c: self._relation_prior(c, single) for c in names}
        start = {c: np.exp(2.0 * prior[c].log) * parts[c].start for c in names}
        observations = [
            Observation(
                s.density,
                {c: g for c, g in s.gains.items() if c in names},
                {c: parts[c].shapes(s) for c in names},
                self.settings.relation_information_share * s.averages,
            )
            for s in spectra
        ]
        observations += self._quiet_bands([c for c in names if c != RAILS], parts)
        found = estimate_components(observations, start, prior, {c: parts[c].level for c in names})
        columns = {c: self._channel(c, parts[c], found) for c in names if c != RAILS}
        if RAILS in names:
            columns |= self._track(found, prior[RAILS])
        return columns

    def _quiet_bands(self, channels: Sequence[str], parts: Mapping[str, _Parts]) -> list[Observation]:
        """Spectra of channels at the top of the frequency range, where these are flat, as further observations."""
        least = float(np.log(self.settings.quiet_noise_factor))
        averages = 1.0 / (2.0 * least) ** 2  # which determine an amplitude as well as the setting says
        observations = []
        for record in self.records:
            for c in channels:
                if c in record.columns and is_flat(record, c, least):
                    f, density = quiet_band(record, c)
                    if density[0] > 2.0 * record.dt * (self.settings.max_quiet_excess * self.bounds[c]) ** 2:
                        continue  # motions fill the whole spectrum
                    shapes = {c: parts[c].densities(f, record.dt)}
                    gains = {c: np.ones((len(f), 1), dtype=complex)}
                    observations.append(Observation(density[:, None, None].astype(complex), gains, shapes, averages))
        return observations

    def _relation_prior(self, channel: str, single: Mapping[str, ColumnNoise]) -> Level:
        if channel == RAILS:
            return self._rails_prior()
        prior = self._prior(channel)
        unknown = float(np.log(self.settings.unknown_noise_factor))
        return prior or Level(float(np.log(max(single[channel].used, MIN_LEVEL))), unknown)

    def _rails_prior(self) -> Level:
        """Prior of the noise of y_w + r phi_w."""
        r = self.geometry.rolling_radius
        sd = float(np.hypot(self.stated.get("yw", 0.0), r * self.stated.get("phiw", 0.0)))
        if sd > 0.0:
            return Level(float(np.log(sd)), float(np.log(self.settings.stated_noise_factor)))
        sd = self.settings.rail_noise_share * float(
            np.median([np.std(record.columns["yw"]) for record in self.records])
        )
        return Level(float(np.log(max(sd, MIN_LEVEL))), float(np.log(self.settings.unknown_noise_factor)))

    def _channel(self, channel: str, parts: _Parts, found: Components) -> ColumnNoise:
        theta = found.variances[channel]
        alone, data_sd = float(np.sqrt(parts.level @ theta)), found.data_log_sd[channel]
        spectrum = parts.spectrum(theta).scaled(float(np.exp(found.log_factor[channel])))
        used = alone * float(np.exp(found.log_factor[channel]))
        stated = self.stated.get(channel)
        is_determined = data_sd < np.log(self.settings.undetermined_noise_factor)
        source = ESTIMATED if stated is None else BOTH if is_determined else STATED
        least = float(np.log(self.settings.relation_noise_factor))
        return ColumnNoise(
            used,
            spectrum,
            stated,
            alone if is_determined else None,
            float(np.hypot(found.log_sd[channel], least)),
            float(np.hypot(data_sd, least)) if is_determined else None,
            source,
        )

    def _track(self, found: Components, prior: Level) -> dict[str, ColumnNoise]:
        """Noise of the track columns, of which the relations determine y_w + r phi_w under the wheelsets.

        One recorder measures all: where its stated noise is wrong, it is so by one factor. Without any stated noise
        the errors of both rails count as independent.
        """
        data_sd, log_factor = found.data_log_sd[RAILS], found.log_factor[RAILS]
        sd = float(np.sqrt(found.variances[RAILS][0])) * float(np.exp(log_factor))
        is_determined = data_sd < np.log(self.settings.undetermined_noise_factor)
        present = [c for c in TRACK if any(np.any(r.columns.get(c, np.zeros(1))) for r in self.records)]
        if not any(self.stated.get(c) for c in ("yw", "phiw")):
            if not is_determined:
                return {}
            b, r = self.geometry.half_gauge, self.geometry.rolling_radius
            yw = sd / (float(np.hypot(1.0, r / b)) if "phiw" in present else 1.0)
            levels = independent_rail_levels(yw, b)
        else:
            ratio = sd / float(np.exp(prior.log)) if is_determined else 1.0
            levels = {c: ratio * self.stated.get(c, 0.0) for c in TRACK}
        return {
            c: ColumnNoise(
                levels[c],
                NoiseSpectrum(levels[c]),
                self.stated.get(c),
                levels[c] * float(np.exp(-log_factor)) if is_determined else None,
                found.log_sd[RAILS],
                data_sd if is_determined else None,
                ESTIMATED if c not in self.stated else BOTH if is_determined else STATED,
            )
            for c in present
            if levels[c] > 0.0
        }

    def _bounded(self, channel: str, noise: ColumnNoise) -> ColumnNoise:
        """Limit the noise of a response to its part that is incoherent with the track and all other channels."""
        bound = self.bounds.get(channel, np.inf)
        if noise.used <= bound or bound <= 0.0:
            return noise
        scaled = noise.spectrum.scaled(bound / noise.used)
        source = ESTIMATED if noise.stated is None else BOTH
        return ColumnNoise(bound, scaled, noise.stated, bound, noise.log_sd, noise.estimated_log_sd, source)


def independent_rail_levels(yw: float, half_gauge: float) -> dict[str, float]:
    """Standard deviations of the track columns from that of y_w, with independent errors of both rails.

    Errors x of each, sidewise and vertically, give y_w = x/sqrt 2, phi_w = sqrt 2 x/(2 b) and gauge = sqrt 2 x.
    """
    return {"yw": yw, "phiw": yw / half_gauge, "gauge": 2.0 * yw}


def _estimated_white(level: Level) -> ColumnNoise:
    """White noise that the data alone determine."""
    sd = float(np.exp(level.log))
    return ColumnNoise(sd, NoiseSpectrum(sd), None, sd, level.sd, level.sd, ESTIMATED)


class _Parts:
    """Parts of the spectrum of a noise: white and coloured; of the rails, white along the track above a wavelength."""

    def __init__(
        self,
        band: tuple[float, float] | None,
        noise_band: float,
        spectra: RelationSpectra,
        settings: NoiseSettings,
        *,
        is_rails: bool,
    ) -> None:
        self.settings = settings
        self.is_rails = is_rails
        self.noise_band = noise_band
        low, high = band_limits(band, spectra.dt)
        self.corners = () if is_rails else corner_frequencies(low, high)
        f = np.linspace(low, high, 1000)
        white = 2.0 * spectra.dt
        self.level = np.array(
            [1.0, *(float(np.mean(markov_density(f, corner, spectra.dt))) / white for corner in self.corners)]
        )
        self.start = np.array([1.0, *(COLOURED_START / self.level[1:])])

    def shapes(self, spectra: RelationSpectra) -> FloatArray:
        """Density [part, F] of each part at unit variance."""
        f = spectra.frequencies
        if self.is_rails:
            highest = spectra.speed / self.noise_band
            return np.where(f < highest, 1.0 / highest, 1e-12)[None]
        return self.densities(f, spectra.dt)

    def densities(self, f: FloatArray, dt: float) -> FloatArray:
        """Density [part, F] of the parts of a channel."""
        return np.stack([markov_density(f, corner, dt) for corner in (np.inf, *self.corners)])

    def spectrum(self, variances: FloatArray) -> NoiseSpectrum:
        """Spectrum of variances [part], without parts that hardly contribute to the band."""
        shares = self.level * variances / max(float(self.level @ variances), 1e-300)
        coloured = zip(self.corners, np.sqrt(variances[1:]), shares[1:], strict=True)
        used = tuple((corner, float(sd)) for corner, sd, share in coloured if share > self.settings.min_coloured_share)
        return NoiseSpectrum(float(np.sqrt(variances[0])), used)


def estimate_noise_model(
    records: Sequence[Record],
    stated: Mapping[str, float],
    geometry: TrackGeometry,
    band: tuple[float, float] | None,
    noise_band: float,
    settings: NoiseSettings,
) -> NoiseModel:
    """Estimate the noise of every column of a campaign.

    Parameters
    ----------
    records
        Unbroken segments of its runs.
    stated
        Standard deviation per column, as far as stated.
    geometry
        Of the wheelsets on the track.
    band
        Compared band [Hz]; None: all frequencies.
    noise_band
        Shortest wavelength of the track noise [m].
    settings
        How far stated and estimated levels are believed.
    """
    return NoiseEstimate(records, stated, geometry, band, noise_band, settings).run()
