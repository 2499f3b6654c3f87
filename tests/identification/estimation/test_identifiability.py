"""What motions determine: directions, profiles, freed coefficients, stretches, changes along the track, two models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.identification.estimation.identifiability import (
    DETERMINED,
    UNSEEN,
    analyse_identifiability,
    estimate_per_section,
    profile_likelihood,
)
from railui.identification.estimation.output_error import Fit, block_distances
from railui.identification.estimation.parallel_models import residual_correlations, two_parallel_models
from railui.identification.estimation.problem import prepare_segments
from railui.identification.structure.candidates import Candidate, CandidateBatch
from railui.identification.structure.drift import find_drifts, hat_functions
from railui.identification.structure.score_test import output_differences
from railui.identification.unmodelled import locate
from railui.identification.unmodelled.coefficients import PORTS, TERMS, _answers, coefficients
from railui.identification.unmodelled.locate import CLEAR, find_variation_along_track, locate_discrepancy
from tests.blind.made import calibrated, simulated_campaign

CONICITY = "contact.leading.conicity"


def changed(fit: Fit, path: str, by: np.ndarray) -> Fit:
    """A fit whose residual holds, to first order, a parameter that is higher by so much in every block of time."""
    gram, j = fit.normal.gram.copy(), 1 + fit.free.paths.index(path)
    own, by = gram[:, :, :, j].copy(), by[:, None]
    gram[:, :, 1:, 0] += by[..., None] * own[:, :, 1:]
    gram[:, :, 0, 1:] += by[..., None] * own[:, :, 1:]
    gram[:, :, 0, 0] += 2 * by * own[:, :, 0] + by**2 * own[:, :, j]
    return replace(fit, normal=replace(fit.normal, gram=gram))


def test_conicity_is_determined_and_the_contact_angle_is_not_seen():
    words = {path: word for path, word, _, _ in analyse_identifiability(calibrated()).classes}
    assert words[CONICITY] == DETERMINED
    assert words["vehicle.primary.lateral_stiffness"] == DETERMINED
    assert words["contact.leading.contact_angle"] == UNSEEN


def test_directions_are_sorted_and_their_deviation_is_one_over_the_singular_value():
    found = analyse_identifiability(calibrated()).directions
    assert len(found) == len(calibrated().free.paths)
    values = [d.singular_value for d in found]
    assert values == sorted(values, reverse=True)
    assert all(d.sd == pytest.approx(1.0 / d.singular_value) for d in found)


def test_the_profile_of_a_determined_number_is_its_parabola():
    fit = calibrated()
    j = fit.free.paths.index(CONICITY)
    found = profile_likelihood(fit, CONICITY, jobs=2)
    by_hand = ((found.values - fit.x[j]) / fit.sd[j]) ** 2
    np.testing.assert_allclose(found.deviance, by_hand, rtol=0.5, atol=0.3)
    assert found.low is not None and found.high is not None
    assert found.low < fit.x[j] < found.high
    assert found.high - found.low == pytest.approx(2 * 1.645 * fit.sd[j], rel=0.25)  # 90 % of a normal distribution


def test_a_freed_coefficient_answers_as_the_kernel_does():
    # the yaw equation's coefficient of psi_1 is a spring between wheelset 1 and the ground
    fit = calibrated()
    answers = _answers(fit, fit.segments[0])
    row = PORTS.index(("wheelset_yaw", 1)) * len(TERMS) + TERMS.index("psi")
    candidate = Candidate("spring", "wheelset_yaw", 1, ({"stiffness": 1e3},))
    exact = output_differences(fit, 0, CandidateBatch((candidate,), ((0, 0),)))[0][0] / 1e3
    assert np.linalg.norm(answers[row] - exact) < 0.25 * np.linalg.norm(exact)


def test_no_coefficient_contradicts_its_derivation_where_nothing_is_missing():
    assert not [c for c in coefficients(calibrated()) if c.contradicts and c.share > 0.01]


def test_a_forgotten_linkage_contradicts_the_yaw_equations():
    best = coefficients(calibrated("spring at=wheelset_yaw stiffness=8e6"))[0]
    assert best.contradicts
    assert best.share > 0.02


def test_hats_sum_to_one_everywhere():
    knots = np.linspace(0.0, 100.0, 7)
    np.testing.assert_allclose(hat_functions(np.linspace(-10.0, 110.0, 50), knots).sum(axis=1), 1.0)


def test_parameters_do_not_change_along_the_track_where_they_are_constant():
    fit = calibrated()
    assert len(block_distances(fit)) == len(fit.normal.gram)
    assert find_drifts(fit)[0].share < 0.02
    found = estimate_per_section(fit, 300.0)
    assert found.values.shape == (len(found.sections), len(found.paths))
    j = found.paths.index(CONICITY)
    assert np.ptp(found.values[:, j]) < 0.2 * fit.x[j]


def test_what_lies_on_the_last_edge_belongs_to_the_last_stretch():
    fit = calibrated()
    s = block_distances(fit)
    length = (s.max() - s.min()) / 2  # the last block stands on an edge
    louder = fit.normal.gram.copy()
    louder[-1, :, 1:, 0] += louder[-1, :, 1:, 1:].sum(axis=-1)
    plain, other = (
        estimate_per_section(replace(fit, normal=replace(fit.normal, gram=g)), length) for g in (fit.normal.gram, louder)
    )
    assert len(plain.sections) == 2
    np.testing.assert_array_equal(plain.values[0], other.values[0])
    assert np.any(plain.values[1] != other.values[1])


def test_stretches_too_short_to_estimate_on_are_refused_with_a_length_that_works():
    fit = calibrated()
    with pytest.raises(ValueError, match=r"too short to estimate parameters on each, give at least \d+ m") as refused:
        estimate_per_section(fit, 2.0)
    enough = float(str(refused.value).split()[-2])
    assert estimate_per_section(fit, enough).values.shape[1] == len(fit.free.paths)


def test_a_parameter_that_is_higher_on_one_stretch_is_so_there_alone():
    fit = calibrated()
    s, j, by = block_distances(fit), fit.free.paths.index(CONICITY), 0.05 * fit.x[fit.free.paths.index(CONICITY)]
    middle = 0.5 * (s.min() + s.max())
    higher = changed(fit, CONICITY, np.where(s >= middle, by, 0.0))
    first, last = (estimate_per_section(higher, middle - s.min()).values - estimate_per_section(fit, middle - s.min()).values)[:, j]
    assert abs(first) < 1e-3 * by and last == pytest.approx(by, rel=0.1)


def test_a_course_is_the_value_along_the_track_of_what_changes():
    fit = calibrated()
    s, x = block_distances(fit), fit.x[fit.free.paths.index(CONICITY)]
    along = (s - s.min()) / np.ptp(s)
    found = find_drifts(changed(fit, CONICITY, 0.3 * x * along))[0]
    assert found.path == CONICITY and found.ratios == {CONICITY: 1.0}
    rise = found.at(np.array([s.max()])) - found.at(np.array([s.min()]))
    assert rise[0] == pytest.approx(0.3 * x, rel=0.1)


def test_a_conicity_that_grows_along_the_track_is_seen_at_the_contact():
    found = find_drifts(calibrated("conicity_drift at=contact per_km=0.4"))[0]
    assert found.path.startswith("contact.")
    assert found.share > 0.1


def test_a_change_along_the_track_is_kept_where_no_curve_can_be_drawn(monkeypatch: pytest.MonkeyPatch):
    fit, one = calibrated("conicity_drift at=contact per_km=0.4"), simulated_campaign("conicity_drift at=contact per_km=0.4")
    along = find_variation_along_track(fit, one.dataset)
    assert along is not None
    weak = replace(along, explained=0.9 * CLEAR)
    monkeypatch.setattr(locate, "spots", lambda fit: [])
    assert locate_discrepancy(fit, one.dataset, one.nominal, weak) is weak


def test_two_parallel_models_come_nearer_one_difference_at_a_time():
    one, fit = simulated_campaign(), calibrated()
    ready = prepare_segments(one.nominal, one.dataset, one.dataset.estimation)
    paths = [p for p in fit.free.paths if "conicity" in p or ("creep" in p and "spin" not in p)]
    found, rho = two_parallel_models(one.nominal, one.dataset, paths, one.nominal, ready, jobs=2)
    begun, _ = two_parallel_models(found.model, one.dataset, paths, one.nominal, ready, jobs=2)
    assert begun.normal.rss == pytest.approx(found.normal.rss, rel=0.05)
    assert found.simulations > 2 * len(paths)
    assert rho.rho.shape == (len(paths), len(rho.channels))
    assert np.abs(residual_correlations(found).steps).max() < 1.0


def test_the_difference_of_two_models_asks_a_parameter_back_to_where_it_was():
    fit = calibrated()
    j, off = fit.free.paths.index(CONICITY), fit.x.copy()
    off[j] *= 0.98
    rho = residual_correlations(replace(fit, x=off))
    assert rho.steps[j] == pytest.approx(0.02 * fit.x[j], rel=0.25)
    assert rho.rho[j].max() > 0.05 and np.abs(rho.rho).max() <= 1.0
