"""Explanations that compete with the effects of the library."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.structure import rivals
from railui.identification.structure.freed_groups import FreedGroups
from railui.identification.structure.rivals import Rival, RivalExplanations
from railui.progress import SILENT


def explanations(**settings: Any) -> RivalExplanations:
    context = SimpleNamespace(settings=LoopSettings().with_values(settings), progress=SILENT)
    return RivalExplanations(cast(Context, context))


def fit_of(rss: float, parameters: int) -> Fit:
    """Return a fit of a vehicle on a track, of which only the misfit and the number of parameters count."""
    model = SimpleNamespace(design=SimpleNamespace(is_on_track=True))
    return cast(Fit, SimpleNamespace(normal=SimpleNamespace(rss=rss), x=np.zeros(parameters), model=model))


@pytest.mark.parametrize(("share", "explains_more"), [(0.42, False), (0.40, True)])
def test_a_drift_must_explain_clearly_more_than_an_effect(share: float, explains_more: bool) -> None:
    """0.43 exceeds 1.05 times 0.40, not 1.05 times 0.42."""
    tried = explanations(rival_ratio=1.05, rival_share=0.10)
    assert tried.explain_more([Rival("a drift", 0.43)], share) is explains_more


def test_a_drift_that_explains_little_rules_out_no_effect() -> None:
    assert not explanations(rival_share=0.10).explain_more([Rival("a drift", 0.09)], 0.0)


@pytest.mark.parametrize(
    ("freed", "explains"),
    [
        (fit_of(20.3, 18), True),  # as many parameters, misfit within 2 %
        (fit_of(20.5, 18), False),
        (fit_of(19.5, 19), False),  # more parameters, misfit lower by less than a factor of 1.05
        (fit_of(19.0, 19), True),
        (None, False),
    ],
)
def test_differing_members_replace_an_effect(
    freed: Fit | None, explains: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against an effect that leaves a misfit of 20 with 18 parameters; groups are tested once for a fit."""
    calls = []
    monkeypatch.setattr(rivals, "free_groups", lambda context, fit: calls.append(fit) or FreedGroups((), freed))
    tried, fit = explanations(simpler_misfit_ratio=1.02, rival_ratio=1.05), fit_of(100.0, 17)
    assert [tried.members_explain_as_much(fit, 20.0, 18) for _ in range(2)] == [explains, explains]
    assert calls == [fit]


def test_the_rivals_of_a_fit_are_sought_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search for a pair asks for those of a model from which a single effect was sought before."""
    calls = []
    drift = SimpleNamespace(path="vehicle.primary.lateral_stiffness", share=0.2)
    monkeypatch.setattr(rivals, "find_drifts", lambda context, fit: calls.append(fit) or [drift])
    monkeypatch.setattr(rivals, "find_couplings", lambda context, fit: [])
    tried, first, second = explanations(), fit_of(1.0, 1), fit_of(1.0, 1)
    found = [tried.outside_library(fit) for fit in (first, second, first)]
    assert calls == [first, second]
    assert found == 3 * [[Rival("vehicle.primary.lateral_stiffness varying along the track", 0.2)]]
