"""Score test (Lagrange-multiplier test) of every candidate effect against the residual of a fit.

The output difference of two parallel models, one with a small amount of the effect, is correlated with the residual
after projecting out what the estimated parameters absorb: a partial rho (Broersen 1976, ch. 5 and 6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.settings.detection import ScoreTestSettings
from railui.campaign.settings.loop_settings import LoopSettings
from railui.core import adds_body
from railui.identification.context import Context
from railui.identification.estimation.block_products import block_length, split_into_blocks
from railui.identification.estimation.fit import Fit, block_duration, residual_variance
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.problem import FitSegment
from railui.identification.events import ScoreTestProgress
from railui.identification.prediction import Predictor, required_steps_each
from railui.identification.structure.candidates import QUADRATURE, Candidate, CandidateBatch, batches_on
from railui.identification.structure.projection import ProjectedScores, Projector
from railui.identification.structure.score_result import ScoreResult
from railui.parallel import map_threads
from railui.vehicle.model import RADIUS, Model, wrap_angle


@dataclass(frozen=True, eq=False)
class ScoreTestResult:
    """Score results of all shapes, family-wise p, critical score.

    best: that of each candidate in descending order; behind all others those that are extrapolated from a part of the
    runs. rss: residual sum of squares that was tested. settings: those of the test.
    """

    results: tuple[ScoreResult, ...]
    best: tuple[ScoreResult, ...]
    p: float
    critical_score: float
    rss: float
    settings: ScoreTestSettings = field(default_factory=ScoreTestSettings)

    @property
    def rho2(self) -> float:
        """Share of the squared residual that the best candidate explains."""
        return self.best[0].admissible_rho ** 2 if self.best else 0.0

    def is_significant(self, score: ScoreResult) -> bool:
        """True where the score of one candidate is significant in the family-wise test."""
        return not score.is_extrapolated and score.admissible_z >= self.critical_score


@dataclass(frozen=True, eq=False)
class _Base:
    """Residual and sensitivities of one segment in blocks [block, 1 + p, sample]."""

    blocks: FloatArray
    length: int


class ScoreTest:
    """Score test on some segments: residual and sensitivities of a fit, against which candidates are scored."""

    def __init__(self, context: Context, fit: Fit, ready: Sequence[FitSegment]) -> None:
        self.context = context
        self.settings = context.settings.score_test
        self.adjuster = GaussNewton.of_fit(context.in_background(context.jobs), fit, ready)
        self.adjuster.restart_windows(fit.x)
        self.fit = replace(fit, segments=tuple(self.adjuster.segments))
        calibration = context.settings.calibration
        seconds = block_duration(calibration, fit.model, [t.segment for t in fit.segments])
        length = [block_length(seconds, t) for t in ready]
        indices = range(len(ready))
        self.bases = list(map_threads(lambda i: _base(self.adjuster, self.fit, i, length[i]), indices, context.jobs))
        inner = np.concatenate([b.blocks @ b.blocks.transpose(0, 2, 1) for b in self.bases])  # [block, 1 + p, 1 + p]
        samples = sum(t.measured.size for t in ready)
        variance = residual_variance(inner.sum(axis=0)[0, 0], samples, calibration.independent_sample_share)
        self.projector = Projector(inner, fit.free, fit.x, variance)
        self.block_count = sum(len(b.blocks) for b in self.bases)

    def run(self, candidates: Sequence[Candidate]) -> tuple[ScoreResult, ...]:
        """Score every shape of every candidate."""
        batches = batches_on(self.fit.model, candidates)
        parts: list[list[ScoreResult]] = []
        for part in map_threads(self._score_batch, batches, self.context.jobs):
            parts.append(part)
            self.context.progress.event(ScoreTestProgress(len(parts), len(batches), tuple(part)))
        return tuple(s for part in parts for s in part)

    def _score_batch(self, batch: CandidateBatch) -> list[ScoreResult]:
        """Score every lane of a batch."""
        self.context.check_time()
        series, is_valid = self.differences(batch)
        if batch.members[0].has_phase:
            return self._score_periodic(batch, series, is_valid[::2] & is_valid[1::2])
        linear = _is_linear(batch)
        scores = self.score(series, self.settings.min_remaining_share_linear if linear else None)
        return [
            scores.score_result(batch.members[member], shape, lane)
            for lane, (member, shape) in enumerate(batch.lanes)
            if is_valid[lane] and scores.is_distinguishable[lane]
        ]

    def differences(self, batch: CandidateBatch) -> tuple[list[FloatArray], NDArray[np.bool_]]:
        """Output differences [lane, channel, n] of a batch on every segment, and which lanes are valid on all."""
        is_valid = np.ones(len(batch.lanes), dtype=bool)
        series = []
        for i in range(len(self.bases)):
            differences, is_valid_here = output_differences(
                self.context.settings, self.fit.model, self.fit.segments[i], batch
            )
            series.append(differences)
            is_valid &= is_valid_here
        return series, is_valid

    def _score_periodic(
        self, batch: CandidateBatch, series: Sequence[FloatArray], is_valid: NDArray[np.bool_]
    ) -> list[ScoreResult]:
        """Score periodic effects at the phases that explain most; series alternate sine and cosine."""
        keys = [t.segment.segment_key for t in self.fit.segments]
        middles = {key.name: key.middle for key in keys}
        phases = self._phases(series)  # [lane, full segment], at distance 0
        index = [list(middles).index(key.name) for key in keys]

        def combined(quadrature: float) -> list[FloatArray]:
            angles = [phases[:, i, None, None] + quadrature for i in index]
            return [np.cos(p) * x[::2] + np.sin(p) * x[1::2] for p, x in zip(angles, series, strict=True)]

        in_phase, in_quadrature = self.score(combined(0.0)), self.score(combined(QUADRATURE))
        segment_of_block = np.repeat(index, [len(b.blocks) for b in self.bases])
        results = []
        for lane, (member, shape) in enumerate(batch.lanes[::2]):
            if is_valid[lane] and in_phase.is_distinguishable[lane]:
                candidate = batch.members[member]
                angles = wrap_angle(phases[lane] + np.array(list(middles.values())) / candidate.shapes[shape][RADIUS])
                result = replace(
                    in_phase.score_result(candidate, shape, lane),
                    phases=dict(zip(middles, angles.tolist(), strict=True)),
                    quadrature_scores=in_quadrature.scores[lane],
                    segment_of_block=segment_of_block,
                )
                results.append(result)
        return results

    def _phases(self, series: Sequence[FloatArray]) -> FloatArray:
        """Phases [lane, full segment] of pairs in sine and cosine that together explain most."""
        keys = [t.segment.segment_key[0] for t in self.fit.segments]
        names = list(dict.fromkeys(keys))
        lanes, parameters = len(series[0]) // 2, len(self.projector.residual_products)
        cross = np.zeros((lanes, len(names), 2, 1 + parameters))
        inner = np.zeros((lanes, len(names), 2, 2))
        for key, target, base, differences in zip(keys, self.fit.segments, self.bases, series, strict=True):
            pairs = _rows_in_blocks(target.without_initial_state(differences), base.length)  # [block, 2 lanes, sample]
            k = names.index(key)
            cross[:, k] += (pairs @ base.blocks.transpose(0, 2, 1)).sum(axis=0).reshape(lanes, 2, 1 + parameters)
            pairs = pairs.reshape(len(pairs), lanes, 2, -1)
            inner[:, k] += np.einsum("blin,bljn->lij", pairs, pairs)
        flat = cross.reshape(lanes, -1, 1 + parameters)
        normal = -flat[:, :, 1:] @ self.projector.inverse @ flat[:, :, 1:].transpose(0, 2, 1)
        for k in range(len(names)):
            normal[:, 2 * k : 2 * k + 2, 2 * k : 2 * k + 2] += inner[:, k]
        score = flat[:, :, 0] - flat[:, :, 1:] @ self.projector.estimate
        amounts = np.einsum(
            "lij,lj->li", np.linalg.pinv(normal, rcond=self.settings.min_remaining_share**2, hermitian=True), score
        )
        sine, cosine = np.moveaxis(amounts.reshape(lanes, -1, 2), 2, 0)
        return np.asarray(np.arctan2(cosine, sine))

    def score(self, series: Sequence[FloatArray], min_remaining_share: float | None = None) -> ProjectedScores:
        """Score output differences [lane, channel, n] of every segment against its residual, by products per block."""
        share = self.settings.min_remaining_share if min_remaining_share is None else min_remaining_share
        cross, norms = [], []
        for target, base, differences in zip(self.fit.segments, self.bases, series, strict=True):
            blocks = _rows_in_blocks(target.without_initial_state(differences), base.length)
            cross.append(blocks @ base.blocks.transpose(0, 2, 1))
            norms.append(np.einsum("bln,bln->bl", blocks, blocks))
        return self.projector.project(np.concatenate(cross), np.concatenate(norms), share)

    def gram(self, series: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Inner products [lane, lane] of output differences after projection, and their scores [lane]."""
        lanes, parameters = len(series[0]), len(self.projector.residual_products)
        cross, inner = np.zeros((lanes, 1 + parameters)), np.zeros((lanes, lanes))
        for target, base, differences in zip(self.fit.segments, self.bases, series, strict=True):
            rows = _rows_in_blocks(target.without_initial_state(differences), base.length)
            cross += np.einsum("bln,bpn->lp", rows, base.blocks)
            inner += np.einsum("bln,bmn->lm", rows, rows, optimize=True)
        return self.projector.gram(cross, inner)


def _base(adjuster: GaussNewton, fit: Fit, index: int, length: int) -> _Base:
    target = fit.segments[index]
    series = adjuster.sensitivities(target, fit.x).converged()
    return _Base(_rows_in_blocks(series, length), length)


def _rows_in_blocks(series: FloatArray, length: int) -> FloatArray:
    """Rearrange series [row, channel, n] to [block, row, channel x sample]."""
    blocks = split_into_blocks(series, length).transpose(2, 0, 1, 3)
    return np.ascontiguousarray(blocks.reshape(len(blocks), len(series), -1))


def output_differences(
    settings: LoopSettings, fitted: Model, target: FitSegment, candidates: CandidateBatch
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Compute output differences per amount [lane, channel, n] of a batch on a segment, and which lanes are valid."""
    test = settings.score_test
    amount = test.linear_effect_amount if _is_linear(candidates) else test.effect_amount
    model = fitted.on_segment(*target.segment.segment_key)
    rows, amounts = candidates.parameter_rows(), candidates.amount_rows(amount)
    rows = np.vstack([rows[:1], rows])  # the first vehicle is the one without effect
    amounts = np.vstack([np.zeros_like(amounts[:1]), amounts])
    vehicles = model.vehicles(target.segment.coach_forces, candidates.placements)
    batch = model.batch(np.tile(model.row, (len(rows), 1)), rows, amounts)
    steps = required_steps_each(vehicles, batch, target.segment, settings.calibration.damped_mode_step)
    is_valid = steps > 0
    is_valid[0] = True
    if not is_valid[1:].any():
        return np.zeros((len(rows) - 1, *target.measured.shape)), np.zeros(len(rows) - 1, dtype=bool)
    # the steps suffice for much larger motions than these, and a small amount of an effect changes them little
    used = min(max(int(steps.max()), target.sensitivity_steps), 2**test.max_step_doublings * target.steps)
    keeps_state = vehicles.state_count(batch.select([0])) >= len(target.initial_state) and not _adds_body(candidates)
    start = target.initial_state if keeps_state else None
    predictor = Predictor(model, target.segment, used, start, target.filter)
    series, diverged = predictor.simulate(batch=batch.select(np.flatnonzero(is_valid)), vehicles=vehicles)
    outputs = np.zeros((len(rows), *series.shape[1:]))
    outputs[is_valid] = series
    is_valid[np.flatnonzero(is_valid)[diverged >= 0]] = False
    differences = (outputs[1:] - outputs[0]) / amount
    differences[~is_valid[1:]] = 0.0
    return differences, is_valid[1:] & is_valid[0]


def _is_linear(candidates: CandidateBatch) -> bool:
    return candidates.members[0].is_linear


def _adds_body(candidates: CandidateBatch) -> bool:
    return adds_body(candidates.members[0].kind)
