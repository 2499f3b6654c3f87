"""Filters of a ride against scipy.signal, and what a ride reads of scipy: nothing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg, signal, special

from railui.core import sosfilt
from railui.dsp.discretise import matrix_exponential, first_order_hold, state_space, sampled_zeros
from railui.dsp.filters import butterworth, frequency_response, padlen, sosfilt_zi, sosfiltfilt
from railui.dsp.spectra import csd, detrend, hann, periodogram, welch
from railui.ride_quality.guidance import log_ndtr
from railui.ride_quality.weighting import SPERLING_B, W_1974, W_D, AnalogFilter, cascade, transmissibility

HOME = Path(__file__).parents[2]
RATE = 400.0
EDGES = [[20.0], [0.1, 2.7], [3.0, 7.0], [60.0, 180.0]]
NOISE = np.random.default_rng(3).standard_normal((3, 4000))


def of_scipy(edges: list[float]) -> np.ndarray:
    kind = "low" if len(edges) == 1 else "bandpass"
    return signal.butter(4, np.squeeze(edges), kind, fs=RATE, output="sos")


def test_a_low_pass_of_second_order_at_a_quarter_of_the_rate_is_that_of_the_hand() -> None:
    """tan(pi/4) = 1: H = (1 + 1/z)^2/(2 + sqrt 2 + (2 - sqrt 2)/z^2)."""
    b, a = 1.0 / (2.0 + np.sqrt(2.0)), (2.0 - np.sqrt(2.0)) / (2.0 + np.sqrt(2.0))
    assert butterworth(2, [25.0], 100.0) == pytest.approx(np.array([[b, 2 * b, b, 1.0, 0.0, a]]), abs=1e-15)


@pytest.mark.parametrize("edges", EDGES)
def test_a_butterworth_filter_has_the_response_of_scipys(edges: list[float]) -> None:
    f = np.geomspace(0.05, 199.0, 400)
    _, theirs = signal.freqz_sos(of_scipy(edges), f, fs=RATE)
    assert np.abs(frequency_response(butterworth(4, edges, RATE), 2 * np.pi * f / RATE) - theirs).max() < 1e-9


@pytest.mark.parametrize("edges", EDGES)
def test_zero_phase_is_sosfiltfilt_to_its_edges(edges: list[float]) -> None:
    theirs = signal.sosfiltfilt(of_scipy(edges), NOISE)
    np.testing.assert_allclose(sosfiltfilt(butterworth(4, edges, RATE), NOISE), theirs, rtol=0, atol=1e-9)
    mirrored = signal.sosfiltfilt(of_scipy(edges), NOISE, padlen=padlen(of_scipy(edges)))
    assert np.array_equal(mirrored, theirs)


def test_a_series_passes_sections_as_sosfilt_has_it_to_the_last_digit() -> None:
    sos = of_scipy([3.0, 7.0])
    memory = NOISE[:, :8].reshape(3, 4, 2)
    theirs, _ = signal.sosfilt(sos, NOISE, zi=memory.transpose(1, 0, 2))
    assert np.array_equal(sosfilt(sos, NOISE, memory), theirs)
    assert np.array_equal(sosfilt(sos, NOISE[0]), signal.sosfilt(sos, NOISE[0]))


def test_sections_in_their_steady_state_stay_there() -> None:
    sos = butterworth(4, [20.0], RATE)
    assert sosfilt_zi(sos) == pytest.approx(signal.sosfilt_zi(sos), abs=1e-12)
    assert sosfilt(sos, np.ones(500), sosfilt_zi(sos)) == pytest.approx(np.ones(500), abs=1e-11)


@pytest.mark.parametrize(("order", "edges"), [(0, [20.0]), (4, [200.0]), (4, [7.0, 3.0]), (4, [0.0, 3.0])])
def test_a_filter_that_cannot_be_is_refused(order: int, edges: list[float]) -> None:
    with pytest.raises(ValueError, match="order of at least 1 and edges that increase between 0 and 200 Hz"):
        butterworth(order, edges, RATE)


@pytest.mark.parametrize("n", [1000, 999, 4000])
def test_densities_are_welchs_by_scipy(n: int) -> None:
    f, found = welch(NOISE[2], RATE, n)
    at, theirs = signal.welch(NOISE[2], RATE, nperseg=n)
    assert np.array_equal(f, at)
    np.testing.assert_allclose(found, theirs, rtol=1e-10, atol=1e-20)
    assert np.array_equal(welch(NOISE[2], RATE, 9000)[1], welch(NOISE[2], RATE, 4000)[1])


@pytest.mark.parametrize("n", [1000, 999, 4000])
def test_cross_densities_and_periodograms_are_scipys(n: int) -> None:
    x, y = NOISE[0], NOISE[0] + 0.3 * np.roll(NOISE[1], 7)
    f, found = csd(x, y, RATE, n)
    at, theirs = signal.csd(x, y, RATE, nperseg=n)
    assert np.array_equal(f, at)
    np.testing.assert_allclose(hann(n), signal.windows.hann(n, sym=False), rtol=0, atol=1e-15)
    np.testing.assert_allclose(found, theirs, rtol=1e-9, atol=1e-12)
    f, power = periodogram(x[:n], RATE)
    at, theirs = signal.periodogram(x[:n], RATE)
    assert np.array_equal(f, at)
    np.testing.assert_allclose(power, theirs, rtol=1e-10, atol=1e-20)


def test_a_series_less_its_line_is_detrended_as_by_scipy() -> None:
    x = NOISE + 3.0 + 0.01 * np.arange(4000)
    np.testing.assert_allclose(detrend(x), signal.detrend(x), rtol=0, atol=1e-12)


def test_the_logarithm_of_the_normal_distribution_is_scipys_however_far_out() -> None:
    x = np.concatenate([-np.geomspace(1e-9, 1e150, 4000), np.geomspace(1e-9, 37.0, 500), np.linspace(-31, -29, 200)])
    np.testing.assert_allclose(log_ndtr(x), special.log_ndtr(x), rtol=1e-12)
    assert log_ndtr([-np.inf, np.inf]).tolist() == [-np.inf, 0.0]


def test_the_exponential_of_a_matrix_is_scipys() -> None:
    rng = np.random.default_rng(5)
    for size in (0.0, 1e-3, 1.0, 40.0):
        a = size * rng.standard_normal((6, 6)) - size * 3.0 * np.eye(6)
        np.testing.assert_allclose(matrix_exponential(a), linalg.expm(a), rtol=1e-11, atol=1e-13)


def zeros(weight: AnalogFilter) -> tuple[np.ndarray, np.ndarray]:
    """The zeros of a weighting's samples as distances z - 1, nearest first: ours, and by the QZ of scipy.linalg."""
    system = first_order_hold(state_space(weight.zeros, weight.poles), 1.0 / RATE)
    (a, b, c, d), n = system, len(system[0])
    found = linalg.eigvals(np.block([[a, b], [c, d]]), np.diag([1.0] * n + [0.0]))
    return sampled_zeros(*system), np.array(sorted(found[np.isfinite(found)], key=abs)[:n])


@pytest.mark.parametrize("weight", [W_D, SPERLING_B])
def test_the_zeros_of_a_weighting_are_those_of_the_generalised_eigenvalue_problem(weight: AnalogFilter) -> None:
    ours, theirs = (found[np.abs(found) > 1e-4] for found in zeros(weight))  # those at s = 0 are put there
    assert len(theirs) >= 2
    np.testing.assert_allclose(ours, theirs, rtol=1e-7)


def test_the_zeros_of_a_long_cascade_are_those_of_sixty_digits() -> None:
    """By mpmath from the poles on; QZ has them to 1e-7."""
    ours, _ = zeros(cascade(W_1974, transmissibility(1.2, 0.2), transmissibility(3.0, 0.1)))
    exact = [-0.02175110609052692, -0.04603079678847842, -0.2099187170731711, -1.0159094595875129, -1.1768186709702337]
    assert ours[2:] == pytest.approx([*exact, -1.7914096688753176, -4.61249056141104, -41.944203831754166], rel=1e-11)


RIDE = ("ride", "designs/test_bogie.yaml", "--track", "erri_b176_high length=300", "--speed", "40")
ASSESS = ("assess", "erri_b176_high length=600", "designs/test_bogie.yaml", "--speed", "40")
STABILITY = ("stability", "designs/check_bogie.yaml", "--speeds", "20:40:20")
HEAVY = {"scipy", "pymoo", "matplotlib", "numpy.ma", "railui.optimisation.study", "railui.campaign.campaign"}


@pytest.mark.parametrize("command", [RIDE, ASSESS, STABILITY], ids=lambda words: words[0])
def test_what_answers_at_once_reads_no_scipy(command: tuple[str, ...]) -> None:
    run = "import sys; from railui.cli import cli; cli(sys.argv[1:], standalone_mode=False)"
    told = f"print('read:', *sorted({HEAVY!r} & set(sys.modules)))"
    words = [sys.executable, "-c", f"{run}; {told}", *command]
    done = subprocess.run(words, cwd=HOME, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "read:"


def test_a_loop_and_the_desk_read_neither_filters_nor_statistics_of_scipy(tmp_path: Path) -> None:
    run = "import sys, railui.desk.app; from railui.cli import cli; cli(sys.argv[1:], standalone_mode=False)"
    told = "print('read:', *sorted({'scipy.signal', 'scipy.stats', 'scipy.interpolate'} & set(sys.modules)))"
    words = [sys.executable, "-c", f"{run}; {told}", "loop", "designs/campaigns/worn_axle_box", "-o", str(tmp_path)]
    done = subprocess.run(words, cwd=HOME, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "read:"
