"""Residual of the final model: how much is left, whether coherent or structured, and where it acts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from railui.identification.context import Context
from railui.identification.estimation.noise_floor import NoiseFloor
from railui.identification.estimation.validation import Validation
from railui.identification.residual.noise_evidence import ResidualEvidence, depends_on_both
from railui.identification.structure.candidate_scores import structured_candidate
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.unmodelled.discrepancy import Discrepancy
from railui.identification.verdict import Remainder, remaining_ratio


def describe_remainder(
    context: Context,
    validations: Mapping[str, Validation],
    floor: NoiseFloor,
    evidence: ResidualEvidence,
    scores: ScoreTestResult,
    discrepancy: Discrepancy | None,
) -> Remainder:
    """Summarise what the final model leaves.

    Parameters
    ----------
    validations
        Of the models before and after.
    scores
        Score test of the residual of the final model.
    discrepancy
        What acts there in addition, outside the library.
    """
    is_on_both = depends_on_both(context.settings.verdict, evidence.surface)
    # with a force curve or a drift the residual is another
    is_explained = discrepancy is not None and discrepancy.lowers_error
    structured = structured_candidate(context.settings.score_test, scores)
    named = None if structured is None else structured.candidate
    located = discrepancy is not None and discrepancy.is_located(context.settings.verdict)
    return Remainder(
        ratio=remaining_ratio(validations["before"], validations["after"], floor),
        coherent_share=evidence.share if np.isfinite(evidence.share) else None,
        coherent=evidence.is_coherent,
        structured=named is not None,
        candidate=None if named is None else (named.kind, named.at, named.wheelset),
        at=discrepancy.at if located and discrepancy else None,
        wheelset=discrepancy.wheelset if located and discrepancy else None,
        surface=evidence.surface if is_on_both and not is_explained else None,
        vibration=None if is_explained else evidence.vibration,
    )
