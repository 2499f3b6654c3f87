"""Variation of a parameter within the runs: what the linear estimate promises has to stand the simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.identification.estimation.output_error import fit_output_error
from railui.identification.structure.drift import Drift
from railui.identification.unmodelled import variation
from railui.identification.unmodelled.variation import find_variation
from tests.blind.simulated import simulated_campaign

STIFFNESS = "vehicle.primary.lateral_stiffness"


@pytest.mark.parametrize(("refined", "is_found"), [(0.9, True), (0.01, False)])
def test_a_variation_has_to_explain_its_share_after_refinement(
    monkeypatch: pytest.MonkeyPatch, refined: float, is_found: bool
) -> None:
    context = simulated_campaign().context
    fit = fit_output_error(context, context.nominal, [STIFFNESS], max_iterations=1)
    s = fit.block_abscissae()
    promised = Drift(
        STIFFNESS, {STIFFNESS: 1.0}, np.array([s.min(), s.max()]), np.full(2, fit.x[0]), np.zeros(2), 0.9,
        squares=fit.normal.gram[:, :, 0, 0].sum(axis=1),
    )  # fmt: skip
    monkeypatch.setattr(variation, "find_drifts", lambda context, fit: [promised])
    monkeypatch.setattr(variation, "refine_drift", lambda context, fit, drift: replace(drift, share=refined))
    assert (find_variation(context, fit) is not None) is is_found
