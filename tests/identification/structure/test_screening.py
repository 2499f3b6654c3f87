"""Screening: springs and dampers are fitted from the nominal model where the estimated parameters absorb them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.context import create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.structure.candidate_scores import NO_SCORE_TEST, run_score_test
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.screening import ScreeningFits
from tests.blind.simulated import simulated_campaign
from tests.truth.effects import effect
from tests.truth.rig import Bench, write


@pytest.mark.parametrize(("share", "fitted"), [(0.01, ["primary_yaw"]), (0.5, [])])
def test_an_element_that_the_parameters_do_not_absorb_is_left_to_the_score_test(monkeypatch, share, fitted):
    context = replace(simulated_campaign().context, jobs=1)
    screening = ScreeningFits(context, calibrate(context))
    spring = Candidate("spring", "primary_yaw", None, ({"stiffness": 1e6},))
    result = ScoreResult(spring, 0, rho=0.1, amount=0.1, scores=np.zeros(4), norm=1.0, unabsorbed_share=share)
    started = []
    monkeypatch.setattr(ScreeningFits, "_start_element", lambda self, s: started.append(s.candidate.at))
    screening.fit_absorbed_elements(replace(NO_SCORE_TEST, best=(result,)), [])
    assert started == fitted


def test_a_candidate_starts_where_the_limits_of_its_law_allow_it():
    context = replace(simulated_campaign().context, jobs=1)
    screening = ScreeningFits(context, calibrate(context))
    damper = Candidate("asymmetric_damper", "secondary_lateral", None, ({"ratio": 0.3},))
    far = ScoreResult(damper, 0, rho=-0.9, amount=-5.0, scores=np.zeros(4), norm=1.0)
    scores = replace(NO_SCORE_TEST, results=(far,), best=(far,))
    [(_, fit)] = screening.fit_candidates(scores, [far])
    assert fit is not None and abs(fit.model.value("effects.0.ratio")) < 1.0


def test_a_clearance_of_a_rig_starts_from_a_stop_that_fits_better(tmp_path):
    """A stop without a spring in its gap is a clearance, whose own starting points may end in a wrong valley."""
    clearance = effect("free_play", "rig", half_width=1e-3)
    write(Bench(seconds=(3.0, 2.0), rate=500.0, seed=2, effects=[clearance]), tmp_path)
    context = create_context(read_dataset(load_campaign(tmp_path)), jobs=1)
    fit = calibrate(context)
    screening, scores = ScreeningFits(context, fit), run_score_test(context, fit)
    kinds = ("free_play", "bump_stop")
    play, stop = (next(s for s in scores.best if s.candidate.kind == kind) for kind in kinds)
    fits = dict(screening.fit_candidates(scores, [play, stop]))
    wrong = screening._start((play.candidate.effect_with({"half_width": 4e-3}), {}))
    assert wrong is not None and wrong.normal.rss > screening.rss_without_effect
    fits[play] = wrong
    screening._improve_clearance(fits)
    assert fits[play].normal.rss < 0.03 * screening.rss_without_effect
    assert fits[play].model.value("effects.0.half_width") == pytest.approx(1e-3, rel=0.05)


def test_a_fit_that_has_become_too_stiff_is_left_as_it_is(tmp_path):
    write(Bench(seconds=(3.0, 2.0), rate=500.0, seed=2), tmp_path)
    context = create_context(read_dataset(load_campaign(tmp_path)), jobs=1)
    fit = calibrate(context)
    screening = ScreeningFits(context, fit)
    stiff = replace(fit, model=fit.model.with_path_values(["vehicle.rig.stiffness"], np.array([1e15])))
    assert screening._iterate(stiff, 2) is stiff
