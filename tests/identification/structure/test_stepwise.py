"""Stepwise selection: a refit next to which the vehicle diverges is left out."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from railui.identification.estimation.problem import DivergedError
from railui.identification.structure.stepwise import StepwiseSelection
from tests.blind.simulated import simulated_campaign


def refit(rss: float) -> SimpleNamespace:
    return SimpleNamespace(rss=rss, candidate=None, fit=SimpleNamespace(x=np.zeros(3)))


@pytest.mark.parametrize(("diverging", "taken"), [(0, 0), (1, 1), (2, None)])
def test_the_best_refit_that_can_be_fitted_once_more_is_taken(monkeypatch, diverging, taken):
    refits = [refit(1.0), refit(1.001)]
    bad = [r.fit for r in refits[:diverging]]

    def final_fit(self, fit):
        if any(fit is one for one in bad):
            raise DivergedError("the vehicle diverges")
        return fit

    monkeypatch.setattr(StepwiseSelection, "_final_fit", final_fit)
    found = StepwiseSelection(simulated_campaign().context)._fitted_once_more(refits)
    assert (None if found is None else found[0]) is (None if taken is None else refits[taken])
