"""Expected results of planned runs: projection, standard deviations and limits against formulas worked out by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.estimation.free_parameters import FreeParameters
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.minimum_detectable import POWER_QUANTILE
from railui.identification.structure.student import from_normal, noncentrality
from railui.planning.expectation import Choice, Expectation
from railui.planning.information import Information
from railui.planning.run_information import RunInformation

SPRING = Candidate("spring", "secondary_lateral", None, ({"stiffness": 1e5},))
DAMPER = Candidate("viscous_damper", "secondary_lateral", None, ({"damping": 1e3},))
GAIN = Candidate("sensor_gain", "b", None, ({"gain": 1.1},))
BLOCKS, LENGTH, DRAWS = 25, 40, 40
MIN_GAIN = 0.1


def run_information(rows: np.ndarray, signal: Sequence[float] = (1e5, 1e5), seed: int = 1) -> RunInformation:
    """Return the products of rows [row, channel, n] with white noise of unit variance."""
    r, c, n = rows.shape
    noise = np.random.default_rng(seed).standard_normal((DRAWS, c, n))
    blocks = rows.reshape(r, c, BLOCKS, n // BLOCKS)
    scores = np.einsum("rcbn,dcbn->dbcr", blocks, noise.reshape(DRAWS, c, BLOCKS, -1)).reshape(-1, c, r)
    channels = rows.transpose(1, 0, 2)
    return RunInformation(
        ("a", "b")[:c],
        channels @ channels.transpose(0, 2, 1),
        scores,
        np.einsum("rcbn,rcbn->bcr", blocks, blocks),
        np.array(signal[:c]),
        np.mean(np.sum(noise**2, axis=2), axis=0),
        n,
    )


def free(count: int, prior_sd: float = np.inf) -> FreeParameters:
    ones = np.ones(count)
    paths = tuple(f"p{i}" for i in range(count))
    return FreeParameters(paths, -9 * ones, 9 * ones, ones, 0 * ones, prior_sd * ones, np.zeros(count, dtype=bool))


def sinusoid(cycles: int, size: float = 1.0, phase: float = 0.0) -> np.ndarray:
    t = np.arange(BLOCKS * LENGTH) / (BLOCKS * LENGTH)
    return size * np.sin(2 * np.pi * cycles * t + phase)


def expectation(rows: np.ndarray, keys: Sequence[Candidate], parameters: int, **options: float) -> Expectation:
    """Return the expectation of one run that serves for estimation and validation."""
    information = Information(free(parameters), tuple((c, 0) for c in keys), (run_information(rows),))
    channels = information.runs[0].channels
    return Expectation(information, Choice(channels, (0,), 0), LoopSettings(), MIN_GAIN, **options)


def one_channel(*rows: np.ndarray) -> np.ndarray:
    return np.stack(rows)[:, None, :]


def test_the_parameters_absorb_the_part_of_an_effect_that_is_parallel_to_them() -> None:
    s, d = sinusoid(50), sinusoid(50, 3.0, phase=0.5)
    expected = expectation(one_channel(s, d), [SPRING], 1)
    (score,) = expected.scores
    assert score is not None
    parallel = float(s @ d / (s @ s))
    assert expected.absorbed[0, 0] == pytest.approx(parallel)
    assert score.norm == pytest.approx(float(np.sum((d - parallel * s) ** 2)))
    assert score.unabsorbed_share == pytest.approx(np.sin(0.5) ** 2, rel=1e-9)


def test_an_effect_that_is_a_parameter_is_not_detectable() -> None:
    expected = expectation(one_channel(sinusoid(50), sinusoid(50, 2.0)), [SPRING], 1)
    assert expected.scores == [None]
    assert expected.detectable() == []


def test_standard_deviations_are_those_of_least_squares_under_white_noise() -> None:
    rows = one_channel(sinusoid(50), sinusoid(50, 1.0, phase=0.3), sinusoid(80))
    expected = expectation(rows, [SPRING], 2)
    sd = np.sqrt(np.diag(np.linalg.inv(rows[:2, 0] @ rows[:2, 0].T)))
    assert expected.parameter_sd == pytest.approx(sd, rel=0.06)  # 1000 realisations of a block


def test_a_prior_bounds_the_standard_deviation() -> None:
    information = Information(free(1, 0.01), ((SPRING, 0),), (run_information(one_channel(sinusoid(9), sinusoid(5))),))
    expected = Expectation(information, Choice(("a",), (0,), 0), LoopSettings(), MIN_GAIN)
    assert expected.parameter_sd[0] < 0.0101


def test_the_limit_meets_the_score_of_the_loop_or_its_gain() -> None:
    d = sinusoid(50, 0.5)
    expected = expectation(one_channel(sinusoid(7), d), [SPRING], 1, critical_score=4.0)
    (score,) = expected.scores
    assert score is not None
    norm = float(d @ d)
    t = from_normal(4.0, score.degrees_of_freedom)
    by_score = noncentrality(t, score.degrees_of_freedom, POWER_QUANTILE) * sqrt(norm) / norm
    assert score.detectable_amount(4.0, POWER_QUANTILE) == pytest.approx(by_score, rel=0.06)
    power = 1e5 + expected.information.runs[0].noise[0]
    gain = (1.0 / 0.9**2 - 1.0) * expected.noise_floor**2
    noise = POWER_QUANTILE * sqrt(norm) / power
    by_gain = (
        LoopSettings().score_test.absorption_margin * (noise + sqrt(noise**2 + norm / power * gain)) / (norm / power)
    )
    assert expected.amounts[0] == pytest.approx(max(by_score, by_gain), rel=0.06)


def test_more_runs_determine_more() -> None:
    rows = one_channel(sinusoid(50), sinusoid(30))
    runs = tuple(run_information(rows, seed=i) for i in range(4))
    information = Information(free(1), ((SPRING, 0),), runs)
    one = Expectation(information, Choice(("a",), (0,), 3), LoopSettings(), MIN_GAIN)
    three = Expectation(information, Choice(("a",), (0, 1, 2), 3), LoopSettings(), MIN_GAIN)
    assert one.parameter_sd[0] / three.parameter_sd[0] == pytest.approx(sqrt(3.0), rel=0.12)


def test_parallel_effects_are_confounded_and_orthogonal_ones_are_not() -> None:
    near = expectation(one_channel(sinusoid(9), sinusoid(50), sinusoid(50, 1.0, phase=0.05)), [SPRING, DAMPER], 1)
    rival = near.rivals()[SPRING][0]
    assert rival.candidate == DAMPER
    assert rival.correlation == pytest.approx(np.cos(0.05), abs=1e-4)
    apart = expectation(one_channel(sinusoid(9), sinusoid(50), sinusoid(70)), [SPRING, DAMPER], 1)
    assert apart.rivals() == {}


def test_the_effect_of_a_sensor_that_is_left_out_is_not_detectable() -> None:
    silent = np.zeros(BLOCKS * LENGTH)
    rows = np.stack([[sinusoid(9), sinusoid(9)], [silent, sinusoid(50, 5.0)]])
    information = Information(free(1), ((GAIN, 0),), (run_information(rows),))
    both = Expectation(information, Choice(("a", "b"), (0,), 0), LoopSettings(), MIN_GAIN)
    alone = Expectation(information, Choice(("a",), (0,), 0), LoopSettings(), MIN_GAIN)
    assert len(both.detectable()) == 1
    assert alone.scores == [None] and alone.detectable() == []


def test_the_critical_score_grows_with_the_library() -> None:
    few = [sinusoid(9), sinusoid(50)]
    many = [sinusoid(9), *(sinusoid(20 + 7 * i) for i in range(40))]
    candidates = [replace(SPRING, at=f"place {i}") for i in range(40)]
    one = expectation(one_channel(*few), candidates[:1], 1)
    forty = expectation(one_channel(*many), candidates, 1)
    assert 2.2 < one.critical_score < 3.0  # two-sided 1 %: 2.58
    assert 3.2 < forty.critical_score < 4.3  # Sidak: 3.66
