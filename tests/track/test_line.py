"""Tracks: checks and resampling."""

import numpy as np
import pytest

from railui.track import (
    Track,
    equally_spaced,
    synthetic_track,
)


def test_a_track_must_be_equally_spaced_finite_and_complete():
    s = np.arange(10) * 0.1
    with pytest.raises(ValueError, match="equally spaced"):
        Track(np.where(s > 0.5, s + 0.05, s), s)
    with pytest.raises(ValueError, match="yw is not finite at sample 3"):
        Track(s, np.where(np.arange(10) == 3, np.nan, s))
    with pytest.raises(ValueError, match="shape"):
        Track(s, s[:9])
    with pytest.raises(ValueError, match="4 samples"):
        Track(s[:3], s[:3])


def test_a_track_is_read_only():
    track = synthetic_track("fra_6")
    with pytest.raises(ValueError, match="read-only"):
        track.yw[0] = 1.0


def test_a_resampled_run_follows_the_spline_of_its_samples():
    rng = np.random.default_rng(0)
    s = np.cumsum(rng.uniform(0.1, 0.3, 500))
    track = equally_spaced(s, np.sin(s / 3), np.cos(s / 5), spacing=0.2)
    np.testing.assert_allclose(track.yw, np.sin(track.s / 3), atol=1e-4)
    np.testing.assert_allclose(track.phiw, np.cos(track.s / 5), atol=1e-4)
    assert not np.any(track.gauge) and track.spacing == pytest.approx(0.2)
