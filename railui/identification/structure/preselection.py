"""Preselection: scores on the first part of the runs select the candidates that are scored on all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.problem import FitSegment
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.locations import JointKey, joint_key
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.score_test import ScoreTest
from railui.vehicle.model import Model


def preselect(
    context: Context, fit: Fit, candidates: Sequence[Candidate], first: Sequence[FitSegment]
) -> tuple[ScoreResult, ...]:
    """Score candidates on shortened segments.

    Those of a vehicle of bodies are scored by groups of joints, then at the single joints of the best groups, and at
    the best of these with every other law: at all joints together it may explain little.
    """
    test, model, settings = ScoreTest(context, fit, first), fit.model, context.settings.score_test
    if model.design.structure is None:
        return test.run(candidates)
    groups = test.run([c for c in candidates if c.wheelset is None])
    single = [c for c in candidates if c.wheelset is not None]
    divided = {_group_of(s.candidate) for s in ranked(groups)[: settings.divided_groups]}
    joints = test.run(with_best_shapes(context, fit, [c for c in single if _group_of(c) in divided], groups))
    places = {_place_of(model, s.candidate) for s in ranked(joints)[: settings.searched_joints]}
    others = [c for c in single if _group_of(c) not in divided and _place_of(model, c) in places]
    return (*groups, *joints, *test.run(with_best_shapes(context, fit, others, groups)))


def with_best_shapes(
    context: Context, fit: Fit, candidates: Sequence[Candidate], scored: Sequence[ScoreResult]
) -> list[Candidate]:
    """Return the candidates of a vehicle of bodies with only those shapes that score best at the same joints.

    scored: results of the candidates themselves, or of the groups that they belong to.
    """
    if fit.model.design.structure is None:
        return list(candidates)
    count = context.settings.score_test.retained_shapes
    best: dict[Candidate, list[Mapping[str, float]]] = {}
    for s in sorted(scored, key=lambda s: -s.admissible_rho):
        shapes = best.setdefault(s.candidate, [])
        if len(shapes) < count:
            shapes.append(s.candidate.shapes[s.shape])

    def reduced(c: Candidate) -> Candidate:
        shapes = best.get(c) or best.get(replace(c, wheelset=None))
        return c if not shapes or c.has_phase else replace(c, shapes=tuple(shapes))

    return [reduced(c) for c in candidates]


def _group_of(candidate: Candidate) -> tuple[str, str]:
    return candidate.kind, candidate.at


def _place_of(model: Model, candidate: Candidate) -> tuple[JointKey, int | None]:
    return joint_key(model, candidate.at), candidate.wheelset


def ranked(results: Sequence[ScoreResult]) -> tuple[ScoreResult, ...]:
    """Best shape of each candidate, in descending order."""
    best: dict[Candidate, ScoreResult] = {}
    for s in results:
        if s.candidate not in best or s.admissible_rho > best[s.candidate].admissible_rho:
            best[s.candidate] = s
    return tuple(sorted(best.values(), key=lambda s: -s.admissible_rho))


def undecided(
    candidates: Sequence[Candidate], preselection: Sequence[ScoreResult], min_remaining_share: float
) -> set[Candidate]:
    """Linear elements that only full segments may distinguish from the estimated parameters.

    A damper between wheelset and track in yaw acts at one speed V as creep: kappa_x + V c / (2 b^2 N), with lambda
    kappa_x unchanged. Only a varying speed distinguishes the two, and the first seconds have one speed.
    """
    decided = {s.candidate for s in preselection if s.unabsorbed_share >= min_remaining_share}
    return {c for c in candidates if c.is_linear and c not in decided}
