"""The measured track: as near to the true one as accelerometers allow, and told where it is not."""

from __future__ import annotations

import numpy as np
import pytest

from railui.capture.processing.align import align
from railui.capture.processing.map_model import RailsModel
from railui.capture.processing.rail_position import Rails, reconstruct
from railui.capture.processing.rail_quality import band_rms, compare
from railui.dsp.integrate import highpass_gain, integrate
from railui.vehicle.wheel_loads import GRAVITY
from tests.capture.rides import GEOMETRY, RATE, Floats, read, ride

RAW = frozenset(("ay1", "ay2", "ayf"))
MODEL = RailsModel()


def rails_of(q: dict[str, Floats], columns: dict[str, Floats], model: RailsModel = MODEL) -> Rails:
    return reconstruct(q, columns["s"], 1 / RATE, model, GEOMETRY, RAW)


def share(found: Floats, true: Floats, s: Floats, settle: int, low: float, high: float) -> float:
    """The rms of an error between two wavelengths beside that of what it should be."""
    grid = np.arange(s[settle], s[-settle - 1], 0.25)
    error, wanted = (np.interp(grid, s, x) for x in (found - true, true))
    return band_rms(error, 0.25, low, high) / band_rms(wanted, 0.25, low, high)


@pytest.mark.parametrize(
    ("noise", "low", "high", "most"),
    [(0.05, 3, 25, 0.05), (0.05, 3, 70, 0.15), (0.01, 3, 70, 0.05), (0.0, 3, 70, 0.015)],
)
@pytest.mark.parametrize("seed", [5, 6])
def test_the_rail_position_is_found_within_its_tolerance(
    noise: float, low: float, high: float, most: float, seed: int
) -> None:
    columns = ride(60.0, seed=seed)
    rails = rails_of(read(columns, noise, seed), columns)
    assert share(rails.columns["yw"], columns["yw"], columns["s"], rails.settle, low, high) < most


def test_cross_level_and_gauge_come_with_it() -> None:
    columns = ride()
    rails = rails_of(read(columns), columns)
    for name in ("phiw", "gauge"):
        assert share(rails.columns[name], columns[name], columns["s"], rails.settle, 3, 70) < 0.03, name


def test_accelerations_are_freed_of_gravity() -> None:
    columns = ride()
    rails = rails_of(read(columns, 1e-6), columns)
    inside = slice(rails.settle, -rails.settle)
    for name in ("ay1", "ay2", "ayf"):
        rest = (rails.columns[name] - columns[name])[inside]
        assert rest.std() < 0.1 * GRAVITY * columns["phiw"].std(), name


def test_each_wheelset_alone_is_worse_than_both() -> None:
    columns = ride()
    rails = rails_of(read(columns), columns)
    both = share(rails.columns["yw"], columns["yw"], columns["s"], rails.settle, 3, 70)
    assert set(rails.versions) == {1, 2}
    assert all(
        share(np.nan_to_num(x), columns["yw"], columns["s"], rails.settle, 3, 70) > both
        for x in rails.versions.values()
    )


def test_the_difference_of_both_wheelsets_tells_the_error() -> None:
    columns = ride(60.0)
    rails = rails_of(read(columns), columns)
    inside = slice(rails.settle, -rails.settle)
    q = compare(rails.versions[1][inside], rails.versions[2][inside], columns["s"][inside], 2.5, rails.natural, 40.0)
    low, high, sd, difference = q.bands[1]
    true = share(rails.columns["yw"], columns["yw"], columns["s"], rails.settle, low, high)
    assert 0.5 < 0.5 * difference / sd / true < 2.0
    assert q.valid is not None and q.valid[0] < 4 and q.valid[1] > 40 and abs(q.lag) < 0.25


def test_a_sign_that_is_wrong_makes_both_wheelsets_disagree() -> None:
    columns = ride()
    q = read(columns)
    rails = rails_of({**q, "ay2": -q["ay2"]}, columns)
    inside = slice(rails.settle, -rails.settle)
    told = compare(rails.versions[1][inside], rails.versions[2][inside], columns["s"][inside], 2.5, rails.natural, 40.0)
    assert told.correlation < 0.5 and told.valid is None


def test_without_a_roll_sensor_the_note_says_what_is_wrong() -> None:
    columns = ride()
    q = {name: x for name, x in read(columns, 0.0).items() if name != "roll_rate1"}
    rails = rails_of(q, columns)
    assert any("g phi_w" in note for note in rails.notes)
    # the error is g phi_w/w^2 and more: far beyond the tolerance, which is why it is said
    assert share(rails.columns["yw"], columns["yw"], columns["s"], rails.settle, 3, 70) > 0.1


def test_an_inclinometer_tells_the_slow_roll_and_the_gyro_the_quick() -> None:
    columns = ride()
    q = read(columns, 0.0)
    lean = columns["phiw"] - 0.05 * columns["e1"] / 0.75
    rails = rails_of({**q, "inclination1": lean + 0.01}, columns)
    rest = (rails.columns["phiw"] - columns["phiw"])[rails.settle : -rails.settle]
    assert abs(rest.mean() - 0.01) < 1e-3 and rest.std() < 0.1 * columns["phiw"].std()


def test_a_double_integration_has_the_gain_that_it_states() -> None:
    t = np.arange(40_000) / RATE
    for f in (0.15, 0.3, 1.0, 13.0):
        w = 2 * np.pi * f
        found = integrate(-(w**2) * np.sin(w * t), 1 / RATE, 2, 0.2, 0.7071)[10_000:30_000]
        expected = float(highpass_gain(np.array([f]), 0.2, 0.7071)[0])
        assert np.sqrt(2) * found.std() == pytest.approx(expected, rel=2e-3)


def test_the_causal_filter_is_a_mass_on_a_spring() -> None:
    # y of y'' + 2 zeta w0 y' + w0^2 y = a for a step a = 1 from rest, in closed form
    w0, zeta, t = 2 * np.pi * 0.2, 0.5, np.arange(4000) / RATE
    wd = w0 * np.sqrt(1 - zeta**2)
    step = np.concatenate(([0.0], np.ones(3999)))
    exact = (1 - np.exp(-zeta * w0 * t) * (np.cos(wd * t) + zeta * w0 / wd * np.sin(wd * t))) / w0**2
    found = integrate(step, 1 / RATE, 2, 0.2, zeta, zero_phase=False)
    assert np.max(np.abs(found - exact)) < 2e-3 * exact.max()


def test_the_causal_reconstruction_is_the_track_through_that_filter() -> None:
    columns = ride()
    model = RailsModel(filter="causal", natural_frequency=0.2)
    rails = rails_of(read(columns, 0.0), columns, model)
    filtered = integrate(columns["yw"], 1 / RATE, 0, 0.2, 0.7071, zero_phase=False)
    assert share(rails.columns["yw"], filtered, columns["s"], 3 * rails.settle, 3, 25) < 0.05


def test_two_runs_over_one_line_are_laid_on_one_distance() -> None:
    s = np.arange(0.0, 1500.0, 0.2)
    yw = np.interp(s, ride(60.0)["s"] - ride(60.0)["s"][0], ride(60.0)["yw"])
    rough = np.random.default_rng(0).normal(0, 1e-4, s.size)
    shift = align(s, yw, s[:5000], (yw + rough)[800:5800])
    assert shift.metres == pytest.approx(160.0, abs=0.05) and shift.correlation > 0.95
    other = ride(60.0, seed=6)
    assert align(s, yw, other["s"], other["yw"]).correlation < 0.8
