"""Input tables, splines and distances."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from railui.core import Spline
from railui.track import (
    COLUMNS,
    Track,
    add_track,
    distance_from_speed,
    input_table,
    run_table,
    synthetic_track,
    track_table,
)


def test_the_table_has_the_columns_of_the_kernel():
    assert (
        *("s", "v", "yw1", "dyw1", "phiw1", "dphiw1", "gauge1"),
        *("yw2", "dyw2", "phiw2", "dphiw2", "gauge2", "Qy", "Qpsi"),
    ) == COLUMNS


@pytest.mark.parametrize("steps", [1, 2, 8])
def test_a_track_at_constant_speed_is_its_spline_at_half_steps_for_both_wheelsets(steps):
    track = synthetic_track("fra_4", length=100.0, seed=1)
    table, dt = track_table(track, 40.0, 1.25, steps)
    assert table.shape == (2 * steps * 999 + 1, 14) and table.flags.c_contiguous and table.dtype == np.float64
    assert dt == pytest.approx(0.0025)
    place = 0.1 * np.arange(2 * steps * 999 + 1) / (2 * steps)
    np.testing.assert_allclose(table[:, 0], place, atol=1e-12)
    assert np.all(table[:, 1] == 40.0) and not np.any(table[:, 12:])
    behind = place - 2.5
    moving = behind > 1e-6
    held = behind < -1e-6
    for at, column in ((0, track.yw), (2, track.phiw), (4, track.gauge)):
        spline = CubicSpline(track.s, column)
        np.testing.assert_allclose(table[:, 2 + at], spline(place), atol=1e-13)
        np.testing.assert_allclose(table[moving, 7 + at], spline(behind[moving]), atol=1e-13)
        np.testing.assert_array_equal(table[held, 7 + at], column[0])
        if at < 4:
            np.testing.assert_allclose(table[:, 3 + at], spline(place, 1), atol=1e-12)
            np.testing.assert_allclose(table[moving, 8 + at], spline(behind[moving], 1), atol=1e-12)
            assert not np.any(table[held, 8 + at])


def test_the_samples_are_exact_in_the_table():
    track = synthetic_track("fra_4", length=200.0)
    table, _ = track_table(track, 30.0, 1.28, 2)
    np.testing.assert_array_equal(table[::4, 0], track.s)
    np.testing.assert_allclose(table[::4, 2], track.yw, rtol=0, atol=1e-17)


def test_the_trailing_wheelset_meets_the_track_one_wheelbase_later():
    track = synthetic_track("erri_b176_high", length=100.0, seed=2)
    table, _ = track_table(track, 25.0, 1.25, 1)  # 2.5 m are 50 half steps
    np.testing.assert_allclose(table[51:, 7:12], table[1:-50, 2:7], atol=1e-12)


def test_a_run_of_changing_speed_reads_the_track_where_the_wheelset_is():
    t = np.arange(2001) / 200
    place = 30 * t + 2 * t**2 - 0.1 * t**3
    speed = 30 + 4 * t - 0.3 * t**2
    columns = {
        "t": t,
        "s": place,
        "v": speed,
        "yw": 1e-3 * np.sin(place / 4),
        "phiw": 1e-3 * np.cos(place / 6),
    }
    columns |= {"gauge": 1e-3 * np.sin(place / 9), "Qy": 1e3 * np.sin(3 * t), "Qpsi": 1e3 * np.cos(2 * t)}
    table, dt = run_table(columns, half_wheelbase=1.3, steps=4)
    at = np.arange(8 * 2000 + 1) / 1600
    s = 30 * at + 2 * at**2 - 0.1 * at**3
    behind = s - 2.6
    assert dt == pytest.approx(0.005)
    np.testing.assert_allclose(table[:, 0], s, atol=1e-9)
    np.testing.assert_allclose(table[:, 1], 30 + 4 * at - 0.3 * at**2, atol=1e-9)
    inner = slice(200, -200)  # away from the ends of the splines
    by_hand = [
        *(np.sin(s / 4), np.cos(s / 4) / 4, np.cos(s / 6), -np.sin(s / 6) / 6, np.sin(s / 9)),
        *(
            np.sin(behind / 4),
            np.cos(behind / 4) / 4,
            np.cos(behind / 6),
            -np.sin(behind / 6) / 6,
            np.sin(behind / 9),
        ),
    ]
    for column, expected in enumerate(by_hand, start=2):
        np.testing.assert_allclose(table[inner, column], 1e-3 * expected[inner], atol=2e-9)
    np.testing.assert_allclose(table[:, 12], 1e3 * np.sin(3 * at), atol=1e-5)
    np.testing.assert_allclose(table[:, 13], 1e3 * np.cos(2 * at), atol=1e-5)


def test_distance_left_out_is_the_integral_of_the_speed():
    t = np.arange(1001) / 100
    v = 20 + 5 * np.sin(t)
    np.testing.assert_allclose(distance_from_speed(t, v), 20 * t + 5 * (1 - np.cos(t)), atol=1e-8)
    bare, _ = run_table({"t": t, "v": v, "yw": 1e-3 * np.sin(t)}, 1.28, 1)
    full, _ = run_table({"t": t, "v": v, "s": distance_from_speed(t, v), "yw": 1e-3 * np.sin(t)}, 1.28, 1)
    np.testing.assert_array_equal(bare, full)


@settings(max_examples=25, deadline=None)
@given(st.floats(1, 120), st.floats(0.5, 2), st.sampled_from([1, 2, 4]), st.floats(0.05, 1))
def test_a_run_at_constant_speed_is_the_track_at_that_speed(speed, half_wheelbase, steps, spacing):
    s = spacing * np.arange(60)
    yw = 1e-3 * np.sin(np.arange(60.0))
    from_track, dt = track_table(Track(s, yw), speed, half_wheelbase, steps)
    from_run, run_dt = run_table({"t": s / speed, "v": np.full(60, speed), "s": s, "yw": yw}, half_wheelbase, steps)
    assert dt == pytest.approx(run_dt)
    np.testing.assert_allclose(from_run, from_track, atol=1e-9)


def test_a_table_rejects_invalid_columns():
    t = np.arange(10) * 0.01
    s, v, yw = 30 * t, np.full(10, 30.0), np.zeros(10)
    with pytest.raises(ValueError, match="must be positive: 0"):
        input_table(t, s, v, yw, None, None, 1.28, 0)
    with pytest.raises(ValueError, match="distance must increase"):
        input_table(t, np.where(t > 0.05, 1.5, s), v, yw, None, None, 1.28, 1)
    with pytest.raises(ValueError, match="time must increase"):
        input_table(t[::-1], s, v, yw, None, None, 1.28, 1)
    with pytest.raises(ValueError, match="column v has shape"):
        input_table(t, s, v[:9], yw, None, None, 1.28, 1)
    with pytest.raises(ValueError, match="column yw is not finite at sample 4"):
        input_table(t, s, v, np.where(np.arange(10) == 4, np.nan, yw), None, None, 1.28, 1)
    with pytest.raises(ValueError, match="yw missing"):
        run_table({"t": t, "v": v}, 1.28, 1)
    with pytest.raises(ValueError, match="speed must be positive"):
        track_table(Track(s, yw), 0.0, 1.28, 1)


def test_noise_added_to_a_table_gives_the_table_of_the_sum():
    rng = np.random.default_rng(5)
    t = np.arange(60) * 0.01
    v = 30.0 + np.sin(t)
    s = 30.0 * t + 1.0 - np.cos(t)
    track, noise = rng.standard_normal((2, 3, 60))
    both = input_table(t, s, v, *(track + noise), 1.25, 2)
    added = add_track(input_table(t, s, v, *track, 1.25, 2), s, list(noise), 1.25)
    assert np.allclose(added, both, rtol=1e-9, atol=1e-9)


def test_a_spline_through_even_locations_agrees_with_scipy() -> None:
    x = 0.1 * np.arange(2000)
    y = np.random.default_rng(1).standard_normal((2000, 3))
    at = np.random.default_rng(2).uniform(-1.0, 201.0, 3000)
    ours, theirs = Spline(x, y), CubicSpline(x, y)
    for result in (at, np.sort(at), x):
        assert np.array_equal(ours(result), theirs(result))
        assert np.array_equal(ours(result, 1), theirs(result, 1))
    assert np.array_equal(ours.coefficients, theirs.c.transpose(2, 0, 1))


def test_a_spline_through_uneven_locations_agrees_with_scipy() -> None:
    x = np.cumsum(np.random.default_rng(3).uniform(0.01, 1.0, 2000))
    y = np.random.default_rng(1).standard_normal(2000)
    at = np.linspace(x[0] - 0.1, x[-1] + 0.1, 3000)
    for order in (0, 1, 2):
        theirs = CubicSpline(x, y)(at, order)
        assert np.abs(Spline(x, y)(at, order) - theirs).max() < 1e-12 * np.abs(theirs).max()


def test_a_distance_is_the_integral_of_the_spline_of_speed() -> None:
    t = np.cumsum(np.random.default_rng(4).uniform(0.01, 0.02, 4000))
    v = 40.0 + 3.0 * np.sin(t)
    assert distance_from_speed(t, v) == pytest.approx(CubicSpline(t, v).antiderivative()(t), rel=1e-13, abs=1e-9)


def test_a_spline_rejects_invalid_points() -> None:
    with pytest.raises(ValueError, match="samples of a spline: 3 given, 4 expected"):
        Spline(np.arange(3.0), np.zeros(3))
    with pytest.raises(ValueError, match="the step to place 2 of a spline is 0"):
        Spline(np.array([0.0, 1.0, 1.0, 2.0]), np.zeros(4))
