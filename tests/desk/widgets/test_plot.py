"""Plot widget: rasterised lines, gaps, decimation, scales and ticks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from railui.desk.widgets.axis import Axis, Scale, scale_of, ticks
from railui.desk.widgets.braille import decimate_min_max, rasterise_line, rasterise_points

Numbers = st.floats(allow_nan=True, allow_infinity=True, width=32)


def test_a_rising_line_runs_from_corner_to_corner() -> None:
    cells = rasterise_line(np.array([0.0, 3.9]), np.array([7.9, 0.0]), 2, 2)
    lower_left, upper_right = 0x40, 0x08  # of a braille cell
    assert cells[1, 0] & lower_left and cells[0, 1] & upper_right
    assert sum(int(bits).bit_count() for bits in cells.ravel()) == 8  # one dot in every row of dots


def test_no_line_is_drawn_over_a_gap() -> None:
    x, y = np.arange(20.0), np.full(20, 2.0)
    y[8:12] = np.nan
    cells = rasterise_line(x, y, 10, 1)
    assert np.all(cells[0, :4]) and not np.any(cells[0, 4:6]) and np.all(cells[0, 6:])


def test_decimation_preserves_the_peak_of_every_column() -> None:
    x = np.linspace(0.0, 99.99, 100_000)
    y = np.zeros(100_000)
    y[34_567] = 1.0
    thin_x, thin_y, _ = decimate_min_max(x, y, 100)
    assert len(thin_x) == 400 and thin_y.max() == 1.0 and abs(thin_x[np.argmax(thin_y)] - 34.0) < 1


def test_a_single_point_between_gaps_is_a_dot() -> None:
    assert rasterise_line(np.array([1.0, 2.0, 3.0]), np.array([np.nan, 1.0, np.nan]), 2, 1).sum() > 0


def test_a_line_far_outside_the_frame_draws_nothing() -> None:
    assert rasterise_line(np.array([0.0, 1e12]), np.array([1e12, 2e12]), 5, 5).sum() == 0


@given(st.lists(st.tuples(Numbers, Numbers), max_size=30), st.integers(1, 12), st.integers(1, 8))
def test_rasterising_accepts_all_numbers(pairs: list[tuple[float, float]], width: int, height: int) -> None:
    x, y = (np.array([pair[i] for pair in pairs], dtype=float) for i in (0, 1))
    with np.errstate(over="ignore", invalid="ignore"):
        assert rasterise_line(x, y, width, height).shape == (height, width)
        assert rasterise_points(x, y, width, height).shape == (height, width)


@given(st.floats(-1e9, 1e9), st.floats(1e-4, 1e9), st.integers(2, 12))
def test_ticks_lie_inside_their_scale(low: float, share: float, most: int) -> None:
    scale = Scale(low, low + share * max(1.0, abs(low)))
    found = [float(scale.position(v)) for v, _ in ticks(scale, most)]
    assert found and min(found) >= -1e-6 and max(found) <= 1 + 1e-6


@pytest.mark.parametrize(
    ("low", "high"), [(0.068801, 0.068809), (0.06880, 0.06882), (2.000001e6, 2.000009e6), (-1e-7, 1e-7), (0.0, 2.5e5)]
)
def test_no_two_ticks_have_the_same_text(low: float, high: float) -> None:
    for most in range(2, 9):
        texts = [text for _, text in ticks(Scale(low, high), most)]
        assert len(set(texts)) == len(texts) >= 2


def test_a_logarithmic_axis_ignores_values_without_logarithm() -> None:
    scale = scale_of(Axis("S", log=True), [np.array([-1.0, 0.0, 1.0, 100.0])], margin=0.0)
    assert (scale.low, scale.high) == (1.0, 100.0) and np.isnan(scale.position(-1.0))
