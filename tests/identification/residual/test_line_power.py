"""Power of spectral lines beyond noise, and its standard deviation."""

from __future__ import annotations

import numpy as np
import pytest

from railui.dsp.spectra import hann_periodogram
from railui.identification.residual.line_power import line_power


@pytest.mark.parametrize(("line", "count"), [(60, 1), (240, 1), (60, 3), (240, 3)])
def test_the_power_in_white_noise_has_the_stated_variance(line: int, count: int) -> None:
    rng, samples = np.random.default_rng(1), 2400
    powers = []
    for _ in range(1500):
        f, density = hann_periodogram(rng.standard_normal(samples), float(samples))
        powers.append(line_power(f, density, line, line, count))
    excess = np.array([p.excess for p in powers])
    stated = np.mean([p.variance for p in powers])
    assert excess.std() == pytest.approx(np.sqrt(stated), rel=0.07)
