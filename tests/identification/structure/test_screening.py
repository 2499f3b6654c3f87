"""Screening: springs and dampers are fitted from the nominal model where the estimated parameters absorb them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.identification.estimation.calibration import calibrate
from railui.identification.structure.candidate_scores import NO_SCORE_TEST
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.evidence import ScoreResult
from railui.identification.structure.screening import ScreeningFits
from tests.blind.simulated import simulated_campaign


@pytest.mark.parametrize(("share", "fitted"), [(0.01, ["primary_yaw"]), (0.5, [])])
def test_an_element_that_the_parameters_do_not_absorb_is_left_to_the_score_test(monkeypatch, share, fitted):
    context = replace(simulated_campaign().context, jobs=1)
    screening = ScreeningFits(context, calibrate(context))
    spring = Candidate("spring", "primary_yaw", None, ({"stiffness": 1e6},))
    result = ScoreResult(spring, 0, 0.1, 0.1, np.zeros(4), 1.0, unabsorbed_share=share)
    started = []
    monkeypatch.setattr(ScreeningFits, "_start_element", lambda self, s: started.append(s.candidate.at))
    screening.fit_absorbed_elements(replace(NO_SCORE_TEST, best=(result,)), [])
    assert started == fitted


def test_a_candidate_starts_where_the_limits_of_its_law_allow_it():
    context = replace(simulated_campaign().context, jobs=1)
    screening = ScreeningFits(context, calibrate(context))
    damper = Candidate("asymmetric_damper", "secondary_lateral", None, ({"ratio": 0.3},))
    far = ScoreResult(damper, 0, -0.9, -5.0, np.zeros(4), 1.0)
    scores = replace(NO_SCORE_TEST, results=(far,), best=(far,))
    [(_, fit)] = screening.fit_candidates(scores, [far])
    assert fit is not None and abs(fit.model.value("effects.0.ratio")) < 1.0
