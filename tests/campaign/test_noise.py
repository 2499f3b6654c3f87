"""Noise model: level and colour of the noise of synthetic channels, alone and with others."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from railui.campaign.noise.estimate import estimate_noise_model
from railui.campaign.noise.flicker import flicker_noise
from railui.campaign.noise.model import ColumnNoise, NoiseModel, as_noise_model
from railui.campaign.noise.spectrum import NoiseSpectrum
from railui.campaign.settings.noise import NoiseSettings
from railui.core import Spline
from railui.dsp.filters import butterworth, sosfiltfilt
from railui.track import band_limited_noise
from railui.vehicle.track_geometry import TrackGeometry
from tests.noise_variants import pink
from tests.truth.campaign import pink as flicker_series

BEHIND = 15  # samples between the wheelsets, at constant speed
A = 0.5 * BEHIND * 35.0 * 0.005
GEOMETRY = TrackGeometry((0.0, 2 * A), rolling_radius=0.46, half_gauge=0.75, half_wheelbase=A)
SD = {"e1": 5e-5, "e2": 5e-5, "ay1": 0.05, "ay2": 0.05, "ayf": 0.02, "rf": 3e-4, "d1": 2e-5, "d2": 2e-5}
TRACK_SD = {"yw": 2e-5, "phiw": 2e-5}
DT, SPEED, BAND = 0.005, 35.0, (0.3, 40.0)


@dataclass(frozen=True)
class SyntheticRecord:
    """Columns without any vehicle: four coordinates that move as they like, and noise."""

    columns: dict[str, np.ndarray]
    channels: list[str]
    dt: float = DT
    kind: str = "bogie"
    mean_speed: float = SPEED


def smooth(rng: np.random.Generator, n: int, sd: float, highest: float) -> np.ndarray:
    """Random motion [n] up to a frequency [Hz]."""
    x = sosfiltfilt(butterworth(4, (0.5, highest), 1.0 / DT), rng.standard_normal(n))
    return np.asarray(sd * x / x.std())


def derivative(x: np.ndarray, order: int) -> np.ndarray:
    f = np.fft.rfftfreq(len(x), DT)
    return np.fft.irfft(np.fft.rfft(x) * (2j * np.pi * f) ** order, len(x))


def record(
    seed: int,
    seconds: float = 60.0,
    channels: tuple[str, ...] = tuple(SD),
    pink_ratio: float = 0.0,
    distortion: float = 0.0,
    gain_e1: float = 1.0,
    speeds: tuple[float, float] = (SPEED, SPEED),
) -> SyntheticRecord:
    """Simulate channels of known noise.

    distortion: m, of a nonlinear motion of wheelset 1 that no track explains. speeds: m/s, at the start and the end.
    """
    rng = np.random.default_rng(seed)
    n = round(seconds / DT)
    t = np.arange(n) * DT
    v = speeds[0] + (speeds[1] - speeds[0]) * t / seconds
    s = 0.5 * (speeds[0] + v) * t
    yw, phiw = smooth(rng, n, 1e-3, 6.0), smooth(rng, n, 1e-3, 6.0)
    at_1 = yw + 0.46 * phiw
    at_2 = Spline(s, at_1)(np.maximum(s - 2.0 * A, 0.0))
    y1, y2 = 1.5 * at_1 + smooth(rng, n, 3e-4, 5.0), 1.5 * at_2 + smooth(rng, n, 3e-4, 5.0)
    y1 = y1 + distortion * np.tanh(y1 / 1e-3) * np.abs(smooth(rng, n, 1.0, 4.0))
    y, psi = 0.5 * (y1 + y2) + smooth(rng, n, 3e-4, 4.0), 0.3 * (y1 - y2) + smooth(rng, n, 2e-4, 4.0)
    clean = {
        "e1": gain_e1 * (y1 - at_1), "e2": y2 - at_2, "ay1": derivative(y1, 2), "ay2": derivative(y2, 2),
        "ayf": derivative(y, 2), "rf": derivative(psi, 1), "d1": y1 - y - A * psi, "d2": y2 - y + A * psi,
    }  # fmt: skip
    columns = {"t": t, "s": s, "v": v}
    for c in channels:
        columns[c] = clean[c] + SD[c] * rng.standard_normal(n)
        if pink_ratio and c.startswith("ay"):
            columns[c] = columns[c] + pink_ratio * SD[c] * np.sqrt(39.7 / 100.0) * pink(rng, n, 1.0 / DT)
    columns["yw"] = yw + band_limited_noise(rng, s, TRACK_SD["yw"], 2.5)
    columns["phiw"] = phiw + band_limited_noise(rng, s, TRACK_SD["phiw"], 2.5)
    return SyntheticRecord(columns, list(channels), mean_speed=float(v.mean()))


def estimate(stated: dict[str, float], *records: SyntheticRecord) -> NoiseModel:
    return estimate_noise_model(records, stated, GEOMETRY, BAND, 2.5, NoiseSettings())


@pytest.mark.parametrize("factor", [None, 1.0 / 3.0, 3.0])
def test_all_channels_together_overrule_what_was_stated(factor: float | None):
    stated = {} if factor is None else {c: factor * sd for c, sd in (SD | TRACK_SD).items()}
    model = estimate(stated, record(1), record(2, 45.0))
    for c, sd in SD.items():
        assert model[c] == pytest.approx(sd, rel=0.25 if c == "rf" else 0.12), c
        assert model.columns[c].source == ("estimated" if factor is None else "both")
    rails = np.hypot(model["yw"], 0.46 * model["phiw"])
    assert rails == pytest.approx(np.hypot(2e-5, 0.46 * 2e-5), rel=0.15)
    assert model.source == ("estimated" if factor is None else "both")


def test_white_and_coloured_noise_is_recovered_within_its_interval():
    model = estimate(SD, record(3, pink_ratio=3.0), record(4, 45.0, pink_ratio=3.0))
    f = np.array([1.0, 3.0])
    for c in ("ay1", "ay2", "ayf"):
        noise = model.columns[c]
        assert abs(np.log(noise.used / (SD[c] * np.sqrt(10.0)))) < 3.0 * noise.log_sd
        assert noise.log_sd < 0.1 and noise.coloured_share > 0.3
        true = 2.0 * DT * SD[c] ** 2 + 9.0 * SD[c] ** 2 * 0.397 / (f * np.log(40.0 / 0.3))
        assert np.sqrt(noise.spectrum.density(f, DT)) == pytest.approx(np.sqrt(true), rel=0.3)
    assert model["e1"] == pytest.approx(SD["e1"], rel=0.12)


def test_the_noise_of_the_track_is_that_at_each_speed_of_a_run():
    """The mean speed alone leaves the noise of the track 30 % too low."""
    model = estimate({}, record(21, speeds=(20.0, 60.0)))
    assert np.hypot(model["yw"], 0.46 * model["phiw"]) == pytest.approx(np.hypot(2e-5, 0.46 * 2e-5), rel=0.1)
    for c in ("e1", "e2", "ay1", "ay2", "d1", "d2"):
        assert model[c] == pytest.approx(SD[c], rel=0.15), c


def test_a_nonlinear_motion_in_other_channels_is_no_noise():
    plain, distorted = (estimate(SD, record(5, distortion=x), record(6, distortion=x)) for x in (0.0, 1e-3))
    for c in SD:
        assert distorted[c] == pytest.approx(plain[c], rel=0.3 if c == "rf" else 0.1), c


def test_a_wrong_gain_is_no_noise_of_the_other_channels():
    model = estimate(SD, record(7, gain_e1=1.3), record(8, gain_e1=1.3))
    for c in ("ay1", "ay2", "e2", "d1", "d2", "ayf"):
        assert model[c] == pytest.approx(SD[c], rel=0.2), c


def test_accelerometers_alone_have_a_wide_interval():
    alone = record(9, channels=("ay1", "ay2"))
    model = estimate({"ay1": 0.15}, alone)
    assert 0.05 < model["ay1"] < 0.08
    assert model.columns["ay1"].log_sd > 0.2 and model.columns["ay2"].source == "estimated"
    assert "yw" not in model  # neither stated nor determined


def accelerometers_with_flicker(seed: int, seconds: float, ratio: float) -> SyntheticRecord:
    """Accelerometers in no kinematic relation, with white noise and 1/f noise of a ratio to its standard deviation."""
    plain = record(seed, seconds, channels=("ay1", "ay2"))
    rng = np.random.default_rng([seed, 1])
    flicker = {c: ratio * SD[c] * flicker_series(len(plain.columns[c]), rng) for c in plain.channels}
    return replace(plain, columns=plain.columns | {c: plain.columns[c] + x for c, x in flicker.items()})


def test_flicker_noise_of_accelerometers_alone_is_found_by_the_upper_half_of_the_spectrum():
    records = [accelerometers_with_flicker(11, 40.0, 20.0), accelerometers_with_flicker(12, 30.0, 20.0)]
    model = estimate({"ay1": 10.0 * SD["ay1"], "ay2": 20.0 * SD["ay2"]}, *records)
    f = np.geomspace(0.5, 20.0, 20)
    flicker = [np.mean([flicker_density(r, c, f) for r in records], axis=0) for c in ("ay1", "ay2")]
    for c, added in zip(("ay1", "ay2"), flicker, strict=True):
        noise = model.columns[c]
        true = np.sqrt(added + 2.0 * DT * SD[c] ** 2)
        assert noise.coloured_share > 0.5
        assert np.sqrt(noise.spectrum.density(f, DT)) == pytest.approx(true, rel=0.5), c
        assert noise.used == pytest.approx(noise.estimated, rel=0.35)


@pytest.mark.parametrize("ratio", [0.0, 0.2])
def test_noise_that_is_white_at_the_top_of_the_spectrum_counts_as_white(ratio: float):
    model = estimate({}, accelerometers_with_flicker(13, 60.0, ratio))
    for c in ("ay1", "ay2"):
        assert model.columns[c].spectrum.coloured == ()
        assert model[c] == pytest.approx(SD[c], rel=0.2)


def test_motions_in_the_upper_half_of_the_spectrum_are_no_flicker_noise():
    plain = record(14, channels=("ay1", "ay2"))
    rng = np.random.default_rng(15)
    motion = sosfiltfilt(butterworth(2, (40.0, 60.0), 1.0 / DT), rng.standard_normal(len(plain.columns["t"])))
    columns = plain.columns | {c: plain.columns[c] + motion for c in plain.channels}
    found = flicker_noise([replace(plain, columns=columns)], "ay1")
    assert found is not None and found.deviation > NoiseSettings().max_flicker_deviation
    assert flicker_noise([record(16, 10.0)], "ay1") is None


def flicker_density(part: SyntheticRecord, channel: str, f: np.ndarray) -> np.ndarray:
    """Density of the 1/f noise of a series with twenty times the standard deviation of the white noise."""
    n = 4 * len(part.columns[channel])  # `flicker_series` is a quarter of a series that has this lowest frequency
    return (20.0 * SD[channel]) ** 2 / (f * np.log(0.5 * n))


@pytest.mark.parametrize("channel", ["ayf", "e1"])
def test_a_single_channel_keeps_its_stated_noise(channel: str):
    model = estimate({channel: SD[channel]}, record(10, channels=(channel,)))
    assert model[channel] == pytest.approx(SD[channel], rel=0.3)


def test_a_channel_in_its_whole_spectrum_is_bounded_by_its_incoherent_part():
    """The quiet band contains motion, which another channel and the track explain."""
    rng = np.random.default_rng(10)
    n = 12000
    motion = rng.standard_normal(n)
    columns = {"t": np.arange(n) * DT, "u": motion, "z": motion + 0.1 * rng.standard_normal(n)}
    rig = SyntheticRecord(columns, ["z"], kind="rig", mean_speed=1.0)
    model = estimate_noise_model([rig], {}, TrackGeometry(), None, 2.5, NoiseSettings())
    assert model["z"] == pytest.approx(0.1, rel=0.1) and "u" not in model


def test_the_noise_of_an_input_is_at_most_its_quiet_band():
    rng = np.random.default_rng(11)
    t = np.arange(8000) * 1e-3
    u = np.sin(20.0 * t) + 0.01 * rng.standard_normal(len(t))
    rig = SyntheticRecord({"t": t, "u": u, "z": u}, ["z"], 1e-3, "rig", 1.0)
    for stated, used in ((0.03, 0.01), (0.005, 0.005)):
        model = estimate_noise_model([rig], {"u": stated}, TrackGeometry(), None, 2.5, NoiseSettings())
        assert model["u"] == pytest.approx(used, rel=0.2)


@pytest.mark.parametrize("friction", [0.0, 0.05])
@pytest.mark.parametrize("sd", [0.003, 0.01, 1.0])
def test_an_acceleration_under_a_broadband_force_is_no_noise(sd: float, friction: float):
    """It follows the force up to half the sampling rate; a weak friction is incoherent with it where the mass moves."""
    rng, n, dt = np.random.default_rng(14), 16000, 1.0 / 400.0
    u = rng.standard_normal(n)
    f = np.fft.rfftfreq(n, dt)
    z = np.fft.irfft(np.fft.rfft(u) / ((7.0**2 - f**2 + 0.05j * 7.0 * f) * (2.0 * np.pi) ** 2), n)
    az = np.fft.irfft(np.fft.rfft(z) * -((2.0 * np.pi * f) ** 2), n) - friction * np.sign(np.gradient(z))
    columns = {"t": np.arange(n) * dt, "u": u, "az": az + sd * rng.standard_normal(n)}
    rig = SyntheticRecord(columns, ["az"], dt, "rig", 1.0)
    found = estimate_noise_model([rig], {}, TrackGeometry(), None, 2.5, NoiseSettings())["az"]
    assert 0.9 * sd < found < 1.42 * np.hypot(sd, friction)


@pytest.mark.parametrize("samples", [40, 400])
def test_a_short_free_decay_has_a_noise(samples: int):
    rng = np.random.default_rng(12)
    t = np.arange(samples) * 1e-2
    z = np.exp(-0.1 * t) * np.cos(3.0 * t) + 1e-3 * rng.standard_normal(samples)
    rig = SyntheticRecord({"t": t, "z": z}, ["z"], 1e-2, "rig", 1.0)
    assert 3e-4 < estimate_noise_model([rig], {"z": 1e-3}, TrackGeometry(), None, 2.5, NoiseSettings())["z"] < 3e-3


def test_drawn_noise_has_the_spectrum_of_the_model():
    spectrum = NoiseSpectrum(0.02, ((1.2, 0.1), (19.2, 0.05)))
    x = spectrum.draw(np.random.default_rng(13), 400_000, DT)
    lines = np.abs(np.fft.rfft(x.reshape(-1, 1000), axis=1)) ** 2
    f = np.fft.rfftfreq(1000, DT)
    density = 2.0 * DT / 1000 * lines.mean(axis=0)
    for low, high in ((0.5, 2.0), (5.0, 10.0), (30.0, 40.0), (80.0, 95.0)):
        used = (f >= low) & (f <= high)
        assert density[used].mean() == pytest.approx(spectrum.density(f[used], DT).mean(), rel=0.1)
    assert x[:200].std() > 0.0 and x.var() == pytest.approx(0.02**2 + 0.1**2 + 0.05**2, rel=0.1)


def test_the_variance_in_the_band_is_that_of_filtered_draws():
    model = NoiseModel({"ay1": ColumnNoise(0.1, NoiseSpectrum(0.05, ((1.2, 0.1),)))})
    sections = butterworth(4, BAND, 1.0 / DT)
    x = sosfiltfilt(sections, model.draw(["ay1", "e1"], 200_000, DT, np.random.default_rng(14)))
    assert model.variance(["ay1", "e1"], sections, DT)[0] == pytest.approx(x[0].var(), rel=0.05)
    assert x[1].std() == 0.0


def test_standard_deviations_become_white_noise():
    model = as_noise_model({"e1": 1e-4})
    assert model["e1"] == 1e-4 and model.columns["e1"].spectrum == NoiseSpectrum(1e-4)
    assert as_noise_model(model) is model


def test_a_track_reconstructed_from_the_axle_boxes_keeps_its_stated_noise():
    def integrated_twice(x: np.ndarray) -> np.ndarray:
        w = 2.0 * np.pi * np.fft.rfftfreq(len(x), DT)
        spectrum = np.fft.rfft(x)
        spectrum[w < 1.0] = 0.0
        return np.fft.irfft(-spectrum / np.maximum(w, 1.0) ** 2, len(x))

    given = record(3)
    c = given.columns
    c["phiw"] = np.zeros_like(c["phiw"])
    at_1, at_2 = (integrated_twice(c[f"ay{i}"]) - c[f"e{i}"] for i in (1, 2))
    c["yw"] = 0.5 * (at_1 + np.roll(at_2, -BEHIND))
    model = estimate({"yw": 2e-5}, given)
    assert model["yw"] > 1e-5
