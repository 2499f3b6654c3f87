"""Published track spectra against their formulas."""

import numpy as np
import pytest

from railui.track import (
    spectrum_density,
    spectrum_sd,
    synthetic_track,
)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("erri_b176_low", (0.714, 1.197, 1.539, 1.696)), ("erri_b176_high", (1.213, 2.035, 2.616, 2.883))],
)
def test_erri_b176_has_its_known_standard_deviations(name, expected):
    bands = ((3, 25), (25, 70), (70, 150), (2, 100))
    result = [1e3 * spectrum_sd(name, "yw", *band) for band in bands]
    assert result == pytest.approx(expected, abs=6e-4)


@pytest.mark.parametrize("wavelength", [3.0, 17.0, 150.0])
def test_erri_b176_is_its_formula(wavelength):
    w = 2 * np.pi / wavelength
    wc2, wr2, ws2 = 0.8246**2, 0.0206**2, 0.4380**2
    lateral = {"low": 2.119e-7, "high": 6.125e-7}
    vertical = {"low": 4.032e-7, "high": 1.080e-6}
    for level in ("low", "high"):
        yw = lateral[level] * wc2 / ((w**2 + wr2) * (w**2 + wc2))
        phiw = vertical[level] / 0.75**2 * wc2 * w**2 / ((w**2 + wr2) * (w**2 + wc2) * (w**2 + ws2))
        result = [float(spectrum_density(f"erri_b176_{level}", q, w)) for q in ("yw", "phiw", "gauge")]
        assert result == pytest.approx([yw, phiw, 0.0], rel=1e-12)


@pytest.mark.parametrize("number", [1, 2, 3, 4, 5, 6])
def test_fra_classes_are_their_formula_with_cross_level_as_height_over_2b(number):
    lateral = [3.3634, 1.2107, 0.4128, 0.3027, 0.0762, 0.0339][number - 1]
    vertical = [1.2107, 1.0181, 0.6816, 0.5376, 0.2095, 0.0339][number - 1]
    ws = [0.6046, 0.9308, 0.8520, 1.1312, 0.8209, 0.4380][number - 1]
    w, wc = 0.3, 0.8245
    yw = 0.25 * lateral * 1e-4 * wc**2 / (w**2 * (w**2 + wc**2))
    height = 4 * 0.25 * vertical * 1e-4 * wc**2 / ((w**2 + wc**2) * (w**2 + ws**2))
    result = [float(spectrum_density(f"fra_{number}", q, w)) for q in ("yw", "phiw", "gauge")]
    assert result == pytest.approx([yw, height / 1.5**2, height], rel=1e-12)


@pytest.mark.parametrize(("name", "factor"), [("sncf_good", 0.509), ("sncf_poor", 1.790)])
def test_sncf_is_a_density_per_cycle_turned_into_one_per_radian(name, factor):
    n = 0.1  # 1/m
    per_cycle = factor * 308e-6 / (1 + n / 0.0489) ** 3
    assert float(spectrum_density(name, "yw", 2 * np.pi * n)) == pytest.approx(per_cycle / (2 * np.pi), rel=1e-12)


def test_an_unknown_spectrum_names_the_nearest():
    with pytest.raises(ValueError, match="did you mean erri_b176_low"):
        synthetic_track("erri_b167_low")
    with pytest.raises(ValueError, match="no track quantity"):
        spectrum_density("fra_1", "twist", 1.0)
