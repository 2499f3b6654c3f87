"""Comparison of simulated with measured channels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

from railui.campaign.comparison import (
    Comparison,
    band_pass,
    compare,
    compared_channels,
    comparison_filter,
    cut_samples,
    nrmse,
    overall_nrmse,
    sosfiltfilt_or_demean,
)
from tests.blind.simulated import simulated_campaign

X = np.array([[3.0, -4.0, 0.0], [1.0, 1.0, 1.0]])


def test_the_error_is_relative_to_the_power_over_all_segments():
    first = Comparison(("e1", "rf"), X, np.zeros_like(X), 0.01)
    second = Comparison(("e1",), X[:1], X[:1], 0.01)
    errors = nrmse([first, second])
    assert errors["e1"] == pytest.approx(math.sqrt(25.0 / 50.0))
    assert errors["rf"] == 1.0
    assert overall_nrmse(errors) == pytest.approx(math.sqrt((0.5 + 1.0) / 2.0))


def test_a_channel_without_motion_has_no_error():
    assert math.isnan(nrmse([Comparison(("e1",), 0.0 * X[:1], X[:1], 0.01)])["e1"])


def test_the_band_pass_is_the_butterworth_filter_of_scipy():
    by_hand = signal.butter(4, [0.3, 40.0], "bandpass", fs=200.0, output="sos")
    x = np.random.default_rng(0).standard_normal((2, 2000))
    ours = sosfiltfilt_or_demean(band_pass((0.3, 40.0), 200.0), x)
    np.testing.assert_allclose(ours, signal.sosfiltfilt(by_hand, x), atol=1e-9)


def test_without_a_band_the_mean_is_subtracted():
    assert sosfiltfilt_or_demean(band_pass(None, 200.0), X).mean(axis=1) == pytest.approx([0.0, 0.0])


def test_both_ends_of_a_segment_are_cut_but_not_those_of_a_window():
    case = simulated_campaign()
    (segment,) = case.dataset.estimation
    campaign = case.dataset.campaign
    assert cut_samples(campaign, segment) == round(2.0 / segment.dt)
    assert cut_samples(campaign, segment.windows(3.0)[0]) == 0
    filtered = comparison_filter(campaign, segment, segment.measured(["e1"]))
    assert filtered.shape == (1, segment.samples - 2 * cut_samples(campaign, segment))


def test_a_segment_compared_with_itself_has_no_error_and_a_diverged_one_is_nan():
    case = simulated_campaign()
    (segment,) = case.dataset.estimation
    measured = segment.measured(segment.channels)
    same = compare(case.dataset.campaign, segment, measured)
    assert list(same.channels) == compared_channels(segment)
    assert set(nrmse([same]).values()) == {0.0}
    diverged = compare(case.dataset.campaign, segment, np.full_like(measured, np.nan))
    assert np.all(np.isnan(diverged.simulated)) and diverged.simulated.shape == same.measured.shape
