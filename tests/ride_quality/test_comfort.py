"""Comfort: the table of ISO 2631, comfort index, Wz and N_MV."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from railui.ride_quality.comfort import (
    ISO_2631_1974,
    comfort_index,
    comfort_time,
    is_comfort_time_clipped,
    n_mv,
    sperling_wz,
)


def test_reduced_comfort_is_reached_at_the_points_of_the_table_over_315():
    hours = {
        0.100: 24,
        0.150: 16,
        0.224: 8,
        0.355: 4,
        0.50: 2.5,
        0.85: 1,
        1.25: 25 / 60,
        1.5: 16 / 60,
        2.0: 1 / 60,
    }
    assert {limit: seconds / 3600 for seconds, limit in ISO_2631_1974} == pytest.approx(hours)
    for limit, time in hours.items():
        assert float(comfort_time(limit / 3.15)) == pytest.approx(3600 * time, rel=1e-12)


def test_between_two_points_the_curve_is_straight_in_logarithms():
    # by hand: half way in the logarithm between 1 h and 25 min
    rms = math.sqrt(0.85 * 1.25) / 3.15
    assert float(comfort_time(rms)) == pytest.approx(math.sqrt(3600 * 1500), rel=1e-12)


def test_comfort_time_is_clipped_outside_the_table():
    assert float(comfort_time(0.0)) == pytest.approx(24 * 3600)
    assert float(comfort_time(0.02)) == pytest.approx(24 * 3600)
    assert float(comfort_time(5.0)) == pytest.approx(60)
    assert is_comfort_time_clipped([0.0, 0.02, 0.1, 0.6, 0.64]).tolist() == [True, True, False, False, True]


@given(st.floats(0, 10), st.floats(0, 10))
def test_more_acceleration_never_gives_more_time(one, other):
    calm, rough = sorted((one, other))
    assert float(comfort_time(calm)) >= float(comfort_time(rough))


def test_the_comfort_index_is_linear_in_the_logarithm_of_time():
    assert comfort_index([60.0, 86400.0, math.sqrt(60 * 86400), 1.0]) == pytest.approx([0, 1, 0.5, 0])


def test_sperlings_wz_is_442_times_the_rms_to_the_power_03():
    assert float(sperling_wz(0.3)) == pytest.approx(4.42 * math.exp(0.3 * math.log(0.3)), rel=1e-12)
    assert float(sperling_wz(0.0)) == 0.0


def test_n_mv_is_six_times_the_95th_percentile_of_blocks_and_absent_under_60():
    blocks = np.arange(101) / 100
    assert n_mv(blocks) == pytest.approx(6 * 0.95)
    assert n_mv(blocks[:59]) is None
    assert n_mv(blocks[:60]) is not None
