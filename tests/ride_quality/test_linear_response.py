"""Transfer functions and stationary response of the linear vehicle, against hand-written equations and simulation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from railui.arrays import ComplexArray
from railui.dsp.spectra import welch
from railui.ride_quality.evaluation import simulate
from railui.ride_quality.linear_response import default_channels, response, variances
from railui.track import Track
from railui.track.density import track_density
from railui.track.excitation import Excitation, TrackSource, resolve_track
from railui.vehicle.channels import all_channels
from railui.vehicle.model import Model
from railui.vehicle.resolve import resolve_model
from railui.vehicle.simulate import simulate_series
from railui.vehicle.transfer import linearise
from tests.cli.runner import ROOT, document, run

CHECK_BOGIE = ROOT / "designs/check_bogie.yaml"
MASSES = np.array([2900.0, 3300.0, 1850.0, 1050.0, 1850.0, 1050.0])


def motions_by_hand(frequency: float, V: float) -> tuple[ComplexArray, ComplexArray]:
    """Return y, psi, y1, psi1, y2, psi2 for unit harmonics of yw and of phiw: (3.9) and (3.10) of Broersen 1976."""
    a, b, r, N, c_y, c_x, k = 1.28, 0.75, 0.46, 55e3, 3.0e6, 8.0e6, 3e4
    lam, kappa_x, kappa_y, kappa_s, eps, delta, sigma = 0.18, 130.0, 120.0, 0.25, 8.0, 0.05, 0.05
    w = 2 * np.pi * frequency
    D = 1j * w  # d/dt
    G = 120.0 * V * sigma / (b * r)
    Z = np.zeros((6, 6), dtype=complex)
    Z[np.diag_indices(6)] = MASSES * D**2
    Z[0] += np.array([k * D + 4 * c_y, 0, -2 * c_y, 0, -2 * c_y, 0])
    Z[1] += np.array([0, k * D + 4 * c_x + 4 * c_y * a**2, -2 * c_y * a, -2 * c_x, 2 * c_y * a, -2 * c_x])
    yw, phiw = np.zeros(6, dtype=complex), np.zeros(6, dtype=complex)
    grip = 2 * N * (eps / b - kappa_s * (eps - sigma) / (b * r))
    for i, sign in ((2, 1.0), (4, -1.0)):
        delay = 1.0 if sign > 0 else np.exp(-D * 2 * a / V)
        Z[i, 0], Z[i, 1] = -2 * c_y, -2 * c_y * sign * a
        Z[i, i] += 2 * c_y + 2 * kappa_y * N * (1 + r * sigma / b) * D / V + grip
        Z[i, i + 1] += -G * D - 2 * kappa_y * N + 2 * kappa_s * N / V * D
        Z[i + 1, 1], Z[i + 1, i] = -2 * c_x, G * D + 2 * b * N * kappa_x * lam / r
        Z[i + 1, i + 1] += 2 * c_x + 2 * b * N * kappa_x * b * D / V - 2 * b * N * (1 - kappa_s / r) * delta
        yw[i] = delay * (grip + 2 * kappa_y * N * r * sigma / (b * V) * D)
        yw[i + 1] = delay * 2 * b * N * kappa_x * lam / r
        phiw[i] = delay * (grip * r + 2 * N + 2 * kappa_y * N * r / V * (1 + r * sigma / b) * D)
        phiw[i + 1] = delay * 2 * b * N * kappa_x * lam
    return np.linalg.solve(Z, yw), np.linalg.solve(Z, phiw)


@pytest.mark.parametrize("frequency", [0.2, 3.5, 12.0, 40.0])
def test_the_transfer_functions_are_those_of_the_equations_of_motion(frequency: float) -> None:
    V, D, r = 40.0, 2j * np.pi * frequency, 0.46
    vehicle = linearise(resolve_model(CHECK_BOGIE), V, ["e1", "e2", "psi1", "ayf", "rf", "d2"])
    found = vehicle.transfer(np.array([frequency]))[0, :, :2]
    expected = []
    for q, track in zip(motions_by_hand(frequency, V), (1.0, r), strict=True):
        later = np.exp(-D * 2.56 / V)
        y, psi, y1, psi1, y2, _ = q
        expected.append([y1 - track, y2 - track * later, psi1, D**2 * y, D * psi, y2 - y + 1.28 * psi])
    np.testing.assert_allclose(found, np.array(expected).T, rtol=2e-6, atol=1e-9)


@pytest.mark.parametrize("design", ["check_bogie", "manchester_coach"])
def test_a_simulation_on_harmonics_has_the_transfer_functions_in_every_channel(design: str) -> None:
    """The track repeats after 200 m, so that its lines do not leak; the tolerance is that of spline and RK4."""
    model = resolve_model(ROOT / f"designs/{design}.yaml")
    linear, speed, period, repeats = Model(model.design.with_effects(())), 40.0, 2000, 10
    s = 0.1 * np.arange(period * repeats)
    lines = np.arange(2, 50)
    phases = np.random.default_rng(1).uniform(0, 2 * np.pi, len(lines))
    wave = 1e-6 * np.cos(2 * np.pi * np.outer(s, lines) / 200.0 + phases).sum(axis=1)
    names, zero = all_channels(linear), np.zeros_like(s)
    vehicle = linearise(linear, speed, names)
    expected = vehicle.transfer(lines * speed / 200.0)
    for i, columns in enumerate(((wave, zero, zero), (zero, wave, zero))):
        excitation = Excitation(TrackSource(Track(s, *columns), "harmonics"), speed)
        series, _ = simulate_series(linear, excitation, names, steps=2)
        found = np.fft.rfft(series[:, -period:])[:, lines] / np.fft.rfft(wave[-period:])[lines]
        size = np.abs(expected[:, :, i]).max(axis=0)
        error = np.abs(found - expected[:, :, i].T).max(axis=1) / np.where(size > 0, size, 1.0)
        assert error.max() < 1e-3, names[int(error.argmax())]


def test_densities_agree_with_those_of_a_simulation_within_their_confidence_interval() -> None:
    """Welch's estimate over K segments with a Hann window that overlap by half has 36 K/19 degrees of freedom.

    The 95 % interval of the ratio to the true density is that of chi-squared over them. The phases of the track are
    random and its amplitudes are not, so that fewer than 5 % of the lines lie outside.
    """
    track, names = "erri_b176_low length=24000 seed=4", ["e1", "e2", "ay1", "ayf", "rf", "d1", "psi2"]
    series = simulate(CHECK_BOGIE, track, 40.0, names)
    rate, n = 400.0, 8192
    segments = 2 * (len(series["t"]) // n) - 1
    freedom = 36 * segments / 19
    low, high = stats.chi2.ppf([0.025, 0.975], freedom) / freedom
    frequency = np.fft.rfftfreq(n, 1 / rate)
    inside = (frequency > 0.5) & (frequency < 12.0)  # the band of the track ends at 0.27 and 13.3 Hz
    result = response(CHECK_BOGIE, 40.0, track, names, frequency[inside])
    for name in names:
        ratio = welch(series[name], rate, n)[1][inside] / result["stationary"][name]["psd"]
        assert np.mean((ratio > low) & (ratio < high)) > 0.95, name
        assert abs(np.mean(ratio) - 1.0) < 0.02, name
        assert result["stationary"][name]["rms"] == pytest.approx(series[name].std(), rel=0.02)


def test_the_comfort_of_the_linear_vehicle_is_that_of_a_long_ride() -> None:
    from railui import ride

    track = "erri_b176_low length=20000 seed=2"
    linear, simulated = response(CHECK_BOGIE, 40.0, track)["ride"], ride(CHECK_BOGIE, track, 40.0)
    for key in ("weighted_acceleration", "weighted_acceleration_1974"):
        assert linear[key] == pytest.approx(simulated["reference"][key], rel=0.02)
    assert linear["flange_margin"] == pytest.approx(simulated["flange_margin"], rel=0.02)


def test_the_variance_does_not_depend_on_the_panels_of_the_quadrature() -> None:
    model = resolve_model(ROOT / "designs/manchester_coach.yaml")
    vehicle, density = linearise(model, 50.0, default_channels(model)), track_density(resolve_track("fra_4"))
    np.testing.assert_allclose(
        variances(vehicle, density), variances(vehicle, density, refinement=3), rtol=1e-7, atol=0
    )


def test_the_density_of_a_measured_track_contains_the_correlation_of_its_columns() -> None:
    """The cross-level follows or precedes the lateral deviation by 1.5 m: only their cross density has that sign."""
    spec = resolve_track("erri_b176_low length=20000 seed=3")
    s, yw = spec.track.s, spec.track.yw
    model, rms = resolve_model(CHECK_BOGIE), []
    for shift in (-15, 15):
        source = TrackSource(Track(s, yw, np.roll(yw, shift) / 0.46, np.zeros_like(s)), "measured")
        rms.append(response(model, 40.0, source, ["ay1"])["stationary"]["ay1"]["rms"])
        assert rms[-1] == pytest.approx(simulate(model, source, 40.0, ["ay1"])["ay1"].std(), rel=0.03)
    assert abs(rms[1] / rms[0] - 1) > 0.1


def test_an_unstable_vehicle_has_no_stationary_response() -> None:
    words = ("response", str(CHECK_BOGIE), "--speed", "62", "--track", "erri_b176_low", "--json", "-", "-q")
    found = document(run(*words))
    assert found["stable"] is False and found["stationary"] is None and found["ride"] is None
    assert "unstable at this speed" in found["notes"][0] and found["transfer"]["e1"]["yw"]["magnitude"]
    assert document(run(*words[:2], "--speed", "61", *words[4:]))["stationary"]["e1"]["rms"] > 0


def test_a_flat_track_gives_no_motion_and_no_margin() -> None:
    s = 0.1 * np.arange(2000)
    source = TrackSource(Track(s, 0 * s, 0 * s, 0 * s), "flat")
    result = response(CHECK_BOGIE, 40.0, source, ["e1"])
    assert result["stationary"]["e1"]["rms"] == 0 and result["ride"]["flange_margin"] is None
    assert result["ride"]["flange_fraction_gaussian"] == 0


def test_a_force_with_memory_has_a_constant_root_and_still_a_stationary_response(tmp_path: Path) -> None:
    """Hysteresis below its yield force is a spring: its root is 0, and the response that of the spring."""
    text, rms = CHECK_BOGIE.read_text("utf-8"), []
    for effect in ("{kind: hysteresis, stiffness: 4e5, yield: 1e5}", "{kind: spring, stiffness: 4e5}"):
        path = tmp_path / "bogie.yaml"
        path.write_text(f"{text}\neffects:\n  - {effect[:-1]}, at: secondary_lateral}}\n")
        result = response(path, 40.0, "erri_b176_low", ["ayf"])
        assert result["stable"]
        rms.append(result["stationary"]["ayf"]["rms"])
    assert rms[0] == pytest.approx(rms[1], rel=1e-6)


def test_a_wheelset_on_rollers_has_a_response_without_a_ride() -> None:
    result = response(ROOT / "designs/roller_rig.yaml", 20.0, "erri_b176_low", ["e1"])
    assert result["stationary"]["e1"]["rms"] > 0
    assert result["ride"] is None and any("above the wheelsets" in note for note in result["notes"])


def test_the_excitation_by_a_wheel_that_is_out_of_round_is_noted_as_left_out(tmp_path: Path) -> None:
    path = tmp_path / "bogie.yaml"
    path.write_text(CHECK_BOGIE.read_text("utf-8") + "\neffects:\n  - {kind: run_out, at: wheelset}\n")
    assert "without the excitation by run_out" in response(path, 40.0)["notes"][-1]


def test_the_command_writes_units_a_figure_and_what_it_left_out(tmp_path: Path) -> None:
    figure = tmp_path / "h.svg"
    coach = str(ROOT / "designs/bogie_under_coach.yaml")
    words = ("response", coach, "--speed", "108 km/h", "--track", "sncf_good", "--channels", "e1,floor.centre")
    result = run(*words, "--frequencies", "1:5:1", "--figure", str(figure), "--json", "-", "-q")
    found = document(result)
    assert found["speed"] == pytest.approx(30.0) and found["frequencies"] == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert found["irregularities"] == ["yw"] or found["irregularities"] == ["yw", "phiw"]
    assert found["transfer"]["floor.centre"]["yw"]["unit"] == "(m/s^2)/m"
    assert found["channels"] == {"e1": {"unit": "m"}, "floor.centre": {"unit": "m/s^2"}}
    assert found["notes"] == ["linear: without creep_saturation, flange_contact"]
    text = figure.read_text()
    for label in ("frequency [Hz]", "PSD [m²/Hz]", "from yw [(m/s²)/m]"):
        assert label in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--speed", "40", "--channels", "e9"), "no channel 'e9', the nearest is 'e2'"),
        (("--speed", "40", "--frequencies", "0:5:1"), "not above 0 Hz"),
        (("--speed", "40", "--frequencies", "1 m"), "a unit like Hz is expected"),
        (("--speed", "144"), "write 144 km/h"),
        (("--speed", "40", "--track", "erri"), "no track spectrum"),
        ((), "Missing option '--speed'"),
    ],
)
def test_a_usage_error_names_its_remedy(words: tuple[str, ...], message: str) -> None:
    result = run("response", str(CHECK_BOGIE), *words)
    assert result.exit_code == 2 and result.stdout == ""
    assert message in " ".join(result.stderr.split())
