"""Start of the calibration, and whether its end is at the stability limit."""

from __future__ import annotations

import re

import numpy as np
import pytest

import railui
from railui.identification import base_model
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import calibrate, fit_without_iteration, stable_start
from railui.identification.estimation.multiple_shooting import max_growth_rate, refit_hunting
from railui.identification.estimation.validation import validate
from tests.blind.simulated import simulated_campaign

NOISE = {"e1": 5e-5, "e2": 5e-5, "ay1": 0.05, "d1": 2e-5}
NOMINAL = railui.Design.load(railui.bundled("test_bogie.yaml"))
FLANGE = "effects: [{kind: flange_contact, at: contact, clearance: 6 mm, stiffness: 1.6e6 N/m}]\n"
PATHS = [
    *(f"contact.{w}.{key}" for w in ("leading", "trailing") for key in ("conicity", "lateral_creep")),
    *(f"vehicle.secondary.{key}" for key in ("lateral_stiffness", "lateral_damping", "yaw_damping")),
]


def with_conicity(conicity: float, effects: str = "") -> railui.Design:
    text = re.sub(r"conicity: [0-9.]+", f"conicity: {conicity}", NOMINAL.to_yaml())
    return railui.Design.from_text(text + effects)


def measured(seed: int) -> railui.Run:
    track = railui.Track.synthetic("erri_b176_high", length=700.0, seed=seed, spacing=0.2)
    series = NOMINAL.simulate(track, 40.0, list(NOISE))
    random = np.random.default_rng(seed)
    noisy = {name: series[name] + sd * random.standard_normal(series["t"].size) for name, sd in NOISE.items()}
    columns = {name: series[name] for name in ("t", "v", "yw", "phiw", "gauge")}
    return railui.Run.from_arrays(**columns, **noisy, name=f"run{seed}")


def campaign_of(design: railui.Design) -> railui.Campaign:
    """Simulated runs of the test bogie, with another design as nominal model."""
    return railui.Campaign.from_runs(
        design, estimation=measured(1), validation=measured(3), noise=NOISE, estimated_parameters=PATHS
    )


def context_of(design: railui.Design) -> Context:
    return create_context(campaign_of(design).dataset, jobs=1)


def test_a_fit_away_from_the_stability_limit_is_not_constrained():
    """Unstable points on the way do not count: no window fit follows."""
    context = context_of(with_conicity(0.45))
    segment = context.dataset.estimation[0]
    fit = calibrate(context)
    assert max_growth_rate(context.nominal, segment) > 1.0 and max_growth_rate(fit.model, segment) < -1.0
    assert not fit.constrained and fit.error_to_noise < 1.1
    assert refit_hunting(context, fit) == (fit, None)


def test_a_calibration_follows_a_valley_of_the_lateral_creep():
    """With sensitivities of few steps it ended at four times the true coefficient of the leading wheelset."""
    fit = calibrate(context_of(with_conicity(0.4)))
    assert fit.error_to_noise < 1.1
    assert fit.x[PATHS.index("contact.leading.lateral_creep")] == pytest.approx(165.0, rel=0.02)


def test_a_calibration_that_diverges_next_to_its_best_point_is_no_missing_effect():
    """Lateral creep of the leading wheelset four times the true one: any effect helps to leave this point."""
    campaign = campaign_of(with_conicity(0.8))
    assert calibrate(create_context(campaign.dataset, jobs=1)).error_to_noise > 4.0
    loop = campaign.loop(jobs=2)
    assert loop.data["verdict"] == "none" and not loop.data["effects"]
    assert loop.data["before"]["nrmse"] < 1.1 * loop.result.noise_floor.nrmse
    assert loop.result.before.x[PATHS.index("contact.leading.lateral_creep")] == pytest.approx(165.0, rel=0.2)


def test_a_failed_calibration_is_replaced_by_a_model_with_its_own_validation(monkeypatch: pytest.MonkeyPatch):
    context = context_of(with_conicity(0.4))
    start = stable_start(context)
    nominal = validate(context, context.nominal, context.dataset.selection)
    monkeypatch.setattr(base_model, "has_failed", lambda *a: True)
    monkeypatch.setattr(base_model, "retry_failed_fit", lambda c, fit, n, v: (fit, None, v))
    base = base_model.calibrated_base(context, nominal)
    own = validate(context, base.fit.model, context.dataset.selection)
    assert base.is_failed and start is not context.nominal and np.array_equal(base.fit.model.row, start.row)
    assert base.validation.nrmse == pytest.approx(own.nrmse, rel=1e-12) and np.isfinite(own.nrmse)
    assert base.validation.nrmse != nominal.nrmse


def test_a_calibration_that_fails_by_a_variation_along_the_track_is_kept(monkeypatch: pytest.MonkeyPatch):
    """The search for a discrepancy starts from it: in the residual of the nominal model the variation is not seen."""
    case = simulated_campaign("primary_drift at=primary_yaw share=-0.5", columns=("ay1", "ay2", "ayf"))
    nominal = validate(case.context, case.nominal, case.dataset.selection)
    monkeypatch.setattr(base_model, "has_failed", lambda *a: True)
    base = base_model.calibrated_base(case.context, nominal)
    assert not base.is_failed and base.validation.nrmse < nominal.nrmse


def test_a_model_whose_hunting_flanges_limit_starts_as_it_is():
    context = context_of(with_conicity(0.4, FLANGE))
    assert stable_start(context) is context.nominal
    assert np.array_equal(fit_without_iteration(context, context.nominal).model.row, context.nominal.row)
