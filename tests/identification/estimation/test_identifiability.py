"""Identifiability, profiles, wheelset coefficients, track sections, drifts and two parallel models."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.settings.estimation import IdentifiabilitySettings
from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.context import create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.identifiability import (
    DETERMINED,
    UNSEEN,
    analyse_identifiability,
    estimate_per_section,
    profile_likelihood,
)
from railui.identification.estimation.parallel_models import residual_correlations, two_parallel_models
from railui.identification.estimation.problem import prepare_segments
from railui.identification.structure.candidates import Candidate, CandidateBatch
from railui.identification.structure.drift import find_drifts, hat_functions
from railui.identification.structure.score_test import output_differences
from railui.identification.unmodelled import locate
from railui.identification.unmodelled.coefficients import PORTS, TERMS, coefficient_responses, estimate_coefficients
from railui.identification.unmodelled.locate import locate_discrepancy
from railui.identification.unmodelled.variation import find_variation
from tests.blind.simulated import Request, calibrated, simulate_together, simulated_campaign

DESIGNS = Path(__file__).parents[3] / "designs"
CONICITY = "contact.leading.conicity"
SPRING = "spring at=wheelset_yaw stiffness=8e6"
GROWTH = "conicity_drift at=contact per_km=0.4"


@pytest.fixture(scope="module", autouse=True)
def _simulated_together() -> None:
    simulate_together(Request(), Request((SPRING,)), Request((GROWTH,)))


def with_deviation(fit: Fit, path: str, by: np.ndarray) -> Fit:
    """Add to the residual of a fit, to first order, a deviation [block] of a parameter."""
    gram, j = fit.normal.gram.copy(), 1 + fit.free.paths.index(path)
    products, by = gram[:, :, :, j].copy(), by[:, None]
    gram[:, :, 1:, 0] += by[..., None] * products[:, :, 1:]
    gram[:, :, 0, 1:] += by[..., None] * products[:, :, 1:]
    gram[:, :, 0, 0] += 2 * by * products[:, :, 0] + by**2 * products[:, :, j]
    return replace(fit, normal=replace(fit.normal, gram=gram))


def test_conicity_is_determined_and_the_contact_angle_is_not():
    classes = {
        path: name for path, name, _, _ in analyse_identifiability(calibrated(), IdentifiabilitySettings()).classes
    }
    assert classes[CONICITY] == DETERMINED
    assert classes["vehicle.primary.lateral_stiffness"] == DETERMINED
    assert classes["contact.leading.contact_angle"] == UNSEEN


def test_directions_are_sorted_by_singular_value():
    result = analyse_identifiability(calibrated(), IdentifiabilitySettings()).directions
    assert len(result) == len(calibrated().free.paths)
    values = [d.singular_value for d in result]
    assert values == sorted(values, reverse=True)
    assert all(d.sd == pytest.approx(1.0 / d.singular_value) for d in result)


def test_the_relative_sd_is_that_of_the_estimates_where_no_prior_matters():
    """Noise that is correlated in time adds to each direction by a factor of its own."""
    fit = calibrated()
    found = {path: sd for path, _, sd, _ in analyse_identifiability(fit, IdentifiabilitySettings()).classes}
    without_prior = [j for j, sd in enumerate(fit.free.prior_sd) if not np.isfinite(sd)]
    determined = [j for j in without_prior if fit.sd[j] < 0.02 * fit.x[j]]
    assert len(determined) > 6
    for j in determined:
        assert found[fit.free.paths[j]] == pytest.approx(fit.sd[j] / fit.x[j], rel=0.2)


def test_what_the_data_do_not_show_has_a_large_relative_sd():
    fit = calibrated()
    j = fit.free.paths.index(CONICITY)
    gram = fit.normal.gram.copy()
    gram[:, :, 1 + j, :] = gram[:, :, :, 1 + j] = 0.0
    unseen = replace(fit, normal=replace(fit.normal, gram=gram))
    classes = analyse_identifiability(unseen, IdentifiabilitySettings()).classes
    assert classes[j][:2] == (CONICITY, UNSEEN) and classes[j][2] > 5.0


def test_the_profile_of_a_determined_parameter_is_a_parabola():
    fit = calibrated()
    j = fit.free.paths.index(CONICITY)
    result = profile_likelihood(simulated_campaign().context, fit, CONICITY)
    by_hand = ((result.values - fit.x[j]) / fit.sd[j]) ** 2
    np.testing.assert_allclose(result.deviance, by_hand, rtol=0.5, atol=0.3)
    assert result.low is not None and result.high is not None
    assert result.low < fit.x[j] < result.high
    assert result.high - result.low == pytest.approx(2 * 1.645 * fit.sd[j], rel=0.25)  # 90 % of a normal distribution


def test_the_profile_of_an_estimate_far_from_its_prior_is_a_parabola():
    context = create_context(read_dataset(load_campaign(DESIGNS / "campaigns" / "worn_axle_box")), jobs=2)
    fit, path = calibrate(context), "contact.trailing.roll"
    j = fit.free.paths.index(path)
    assert abs(fit.x[j] - fit.free.prior[j]) > 3.0 * fit.free.prior_sd[j]
    result = profile_likelihood(context, fit, path)
    np.testing.assert_allclose(result.deviance, ((result.values - fit.x[j]) / fit.sd[j]) ** 2, rtol=0.5, atol=0.3)
    assert result.low is None and result.high == pytest.approx(fit.x[j] + 1.645 * fit.sd[j], rel=0.05)  # from its bound


def test_the_sensitivity_of_a_coefficient_agrees_with_the_kernel():
    # the coefficient of psi_1 in the yaw equation is a spring between wheelset 1 and the ground
    fit = calibrated()
    answers = coefficient_responses(fit, fit.segments[0], 6.0)
    row = PORTS.index(("wheelset_yaw", 1)) * len(TERMS) + TERMS.index("psi")
    candidate = Candidate("spring", "wheelset_yaw", 1, ({"stiffness": 1e3},))
    batch = CandidateBatch((candidate,), ((0, 0),))
    exact = output_differences(LoopSettings(), fit.model, fit.segments[0], batch)[0][0] / 1e3
    assert np.linalg.norm(answers[row] - exact) < 0.25 * np.linalg.norm(exact)


def test_without_an_unmodelled_effect_no_coefficient_is_contradicted():
    assert not [
        c
        for c in estimate_coefficients(simulated_campaign().context, calibrated())
        if c.contradicts_derivation and c.share > 0.01
    ]


def test_an_unmodelled_linkage_contradicts_the_yaw_equations():
    best = estimate_coefficients(simulated_campaign(SPRING).context, calibrated(SPRING))[0]
    assert best.contradicts_derivation
    assert best.share > 0.02


def test_hat_functions_sum_to_one():
    knots = np.linspace(0.0, 100.0, 7)
    np.testing.assert_allclose(hat_functions(np.linspace(-10.0, 110.0, 50), knots).sum(axis=1), 1.0)


def test_constant_parameters_show_no_drift():
    fit = calibrated()
    assert len(fit.block_abscissae()) == len(fit.normal.gram)
    assert find_drifts(simulated_campaign().context, fit)[0].share < 0.02
    result = estimate_per_section(simulated_campaign().context, fit, 300.0)
    assert result.values.shape == (len(result.sections), len(result.paths))
    j = result.paths.index(CONICITY)
    assert np.ptp(result.values[:, j]) < 0.2 * fit.x[j]


def test_constant_parameters_scatter_over_sections_as_their_standard_deviations_say():
    fit = calibrated()
    result = estimate_per_section(simulated_campaign().context, fit, 300.0)
    by_data = [j for j, sd in enumerate(fit.free.prior_sd) if fit.sd[j] < 0.3 * sd]
    assert len(by_data) > 10
    assert 0.5 < np.mean(result.chi2[by_data]) < 2.0
    assert np.all(np.ptp(result.values[:, by_data], axis=0) > 0.1 * result.sd[:, by_data].max(axis=0))


def test_the_estimates_of_sections_do_not_depend_on_the_units_of_the_parameters():
    fit = calibrated()
    factors = np.ones(len(fit.x))
    factors[fit.free.paths.index("vehicle.primary.lateral_stiffness")] = 1e6
    rows = np.concatenate([[1.0], factors])
    normal = replace(fit.normal, gram=fit.normal.gram / np.outer(rows, rows))
    free = replace(fit.free, prior=fit.free.prior * factors, prior_sd=fit.free.prior_sd * factors)
    covariance = fit.covariance * np.outer(factors, factors)
    rescaled = replace(fit, x=fit.x * factors, normal=normal, free=free, given_covariance=covariance)
    context = simulated_campaign().context
    plain, other = (estimate_per_section(context, f, 300.0) for f in (fit, rescaled))
    np.testing.assert_allclose(other.values, plain.values * factors, rtol=1e-8)
    np.testing.assert_allclose(other.sd, plain.sd * factors, rtol=1e-8)


def test_the_last_edge_belongs_to_the_last_section():
    fit = calibrated()
    s = fit.block_abscissae()
    length = (s.max() - s.min()) / 2  # the last block lies on an edge
    changed = fit.normal.gram.copy()
    changed[-1, :, 1:, 0] += changed[-1, :, 1:, 1:].sum(axis=-1)
    plain, other = (
        estimate_per_section(
            simulated_campaign().context,
            replace(fit, normal=replace(fit.normal, gram=g), given_covariance=fit.covariance),
            length,
        )
        for g in (fit.normal.gram, changed)
    )
    assert len(plain.sections) == 2
    np.testing.assert_allclose(plain.values[0], other.values[0], rtol=1e-10)
    assert np.max(np.abs(plain.values[1] / other.values[1] - 1.0)) > 0.1


def test_sections_too_short_are_refused_with_a_sufficient_length():
    fit = calibrated()
    with pytest.raises(ValueError, match=r"too short to estimate parameters on each, give at least \d+ m") as refused:
        estimate_per_section(simulated_campaign().context, fit, 2.0)
    enough = float(str(refused.value).split()[-2])
    assert estimate_per_section(simulated_campaign().context, fit, enough).values.shape[1] == len(fit.free.paths)


def test_a_deviation_on_one_section_is_estimated_there_only():
    fit = calibrated()
    s, j, by = fit.block_abscissae(), fit.free.paths.index(CONICITY), 0.05 * fit.x[fit.free.paths.index(CONICITY)]
    middle = 0.5 * (s.min() + s.max())
    higher = with_deviation(fit, CONICITY, np.where(s >= middle, by, 0.0))
    first, last = (
        estimate_per_section(simulated_campaign().context, higher, middle - s.min()).values
        - estimate_per_section(simulated_campaign().context, fit, middle - s.min()).values
    )[:, j]
    assert abs(first) < 1e-3 * by and last == pytest.approx(by, rel=0.1)


def test_a_drift_follows_the_value_along_the_track():
    fit = calibrated()
    s, x = fit.block_abscissae(), fit.x[fit.free.paths.index(CONICITY)]
    along = (s - s.min()) / np.ptp(s)
    result = find_drifts(simulated_campaign().context, with_deviation(fit, CONICITY, 0.3 * x * along))[0]
    assert result.path == CONICITY and result.ratios == {CONICITY: 1.0}
    rise = result.value_at(np.array([s.max()])) - result.value_at(np.array([s.min()]))
    assert rise[0] == pytest.approx(0.3 * x, rel=0.1)


def test_a_conicity_that_grows_along_the_track_is_located_at_the_contact():
    result = find_drifts(simulated_campaign(GROWTH).context, calibrated(GROWTH))[0]
    assert result.path.startswith("contact.")
    assert result.share > 0.1


def test_a_variation_along_the_track_is_returned_without_force_curves(monkeypatch: pytest.MonkeyPatch):
    fit, case = calibrated(GROWTH), simulated_campaign(GROWTH)
    variation = find_variation(case.context, fit)
    assert variation is not None
    weak = replace(variation, explained_share=0.9 * case.context.settings.discrepancy.reliable_share)
    monkeypatch.setattr(locate, "curve_locations", lambda settings, fit: [])
    assert locate_discrepancy(case.context, fit, weak) is weak


def test_two_parallel_models_converge():
    case, fit = simulated_campaign(), calibrated()
    paths = [p for p in fit.free.paths if "conicity" in p or ("creep" in p and "spin" not in p)]
    campaign = replace(case.dataset.campaign, estimated_parameters=tuple(paths))
    context = create_context(replace(case.dataset, campaign=campaign), jobs=2)
    ready = prepare_segments(context, case.nominal, case.dataset.estimation)
    result = two_parallel_models(context, case.nominal, ready)
    restarted = two_parallel_models(context, result.model, ready)
    assert restarted.normal.rss == pytest.approx(result.normal.rss, rel=0.05)
    assert result.simulations > 2 * len(paths)
    correlations = residual_correlations(context, result)
    assert correlations.rho.shape == (len(paths), len(correlations.channels))
    assert np.abs(correlations.steps).max() < 1.0


def test_the_difference_of_two_models_corrects_a_parameter():
    fit = calibrated()
    j, off = fit.free.paths.index(CONICITY), fit.x.copy()
    off[j] *= 0.98
    rho = residual_correlations(simulated_campaign().context, replace(fit, x=off))
    assert rho.steps[j] == pytest.approx(0.02 * fit.x[j], rel=0.25)
    assert rho.rho[j].max() > 0.05 and np.abs(rho.rho).max() <= 1.0
