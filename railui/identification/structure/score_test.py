"""The trace: a little of every candidate effect beside the adjusted vehicle, correlated with the residual.

The output difference of two parallel models, after what the adjustable parameters absorb has been projected
out, against the residual: a partial rho (Broersen 1976, ch. 5 and 6; the score test of statistics).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.dataset import simulate
from railui.core import Batch, Vehicles
from railui.identification.estimation.block_products import split_into_blocks, block_length
from railui.identification.estimation.output_error import Fit, GaussNewton, block_seconds, residual_variance
from railui.identification.estimation.problem import FitSegment
from railui.identification.events import ScoreTestProgress
from railui.identification.structure.candidates import LINEAR, QUADRATURE, Candidate, CandidateBatch, batch_candidates
from railui.identification.structure.evidence import ScoreResult, family_wise_test, signed_rho
from railui.identification.structure.projection import VANISHED, ProjectedScores, Projector
from railui.parallel import map_threads
from railui.progress import Watch, unwatched
from railui.vehicle.model import RADIUS, less_turns

AMOUNT = 0.05  # of a candidate beside the adjusted vehicle
LITTLE = 5e-4  # of a linear element: adjusting absorbs nearly all of it, and the curvature of that is no more of it
POWER = 1.2816  # normal quantile of 90 % power
KEPT = 12  # candidates that are seen on the whole of the runs after a first look
FINEST = 4  # times the steps of the adjusted vehicle that a little of an effect is looked at with
FAINT = 1e-5  # share that the projection leaves of a linear element below which nothing new is in it


@dataclass(frozen=True, eq=False)
class ScoreTestResult:
    """All sightings, the best of each candidate first; family-wise p; the misfit that was searched."""

    results: tuple[ScoreResult, ...]
    best: tuple[ScoreResult, ...]
    p: float
    critical: float
    rss: float

    @property
    def rho2(self) -> float:
        """Share of the squared residual that the best candidate explains."""
        return max((signed_rho(s) ** 2 for s in self.best), default=0.0)


@dataclass(frozen=True, eq=False)
class _Base:
    """Residual and sensitivities of the adjusted vehicle in blocks [block, 1 + p, sample] of one stretch."""

    blocks: FloatArray
    length: int


def score_test(
    fit: Fit,
    found: Sequence[Candidate],
    *,
    first: Sequence[FitSegment] = (),
    jobs: int | None = None,
    seed: int = 0,
    watch: Watch = unwatched,
) -> ScoreTestResult:
    """See every candidate against the residual of a fit.

    Where `first` holds shortened stretches, all candidates are seen on them and only the best on all of the fit's; what
    the others would have said there is forecast, for what could have been seen.
    """
    whole = ScoreTest(fit, fit.segments)
    if not first or sum(t.measured.size for t in first) >= 0.7 * sum(t.measured.size for t in fit.segments):
        sightings = near = whole.run(found, jobs, watch)
    else:
        glimpse = ScoreTest(fit, first)
        glimpsed = glimpse.run(found, jobs, watch)
        kept = {s.candidate for s in _ranked(glimpsed)[:KEPT]} | _hidden(found, glimpsed)
        near = whole.run([c for c in found if c in kept], jobs, watch)
        ratio = sum(t.measured.size for t in fit.segments) / sum(t.measured.size for t in first)
        far = [s.forecast(ratio, whole.count) for s in glimpsed if s.candidate not in kept]
        sightings = (*near, *far)
    p, critical = family_wise_test(sightings, seed, near)
    return ScoreTestResult(tuple(sightings), _ranked(sightings), p, critical, whole.solver.rest)


def _ranked(sightings: Sequence[ScoreResult]) -> tuple[ScoreResult, ...]:
    """The best shape of each candidate, best first."""
    best: dict[Candidate, ScoreResult] = {}
    for s in sightings:
        if s.candidate not in best or signed_rho(s) > signed_rho(best[s.candidate]):
            best[s.candidate] = s
    return tuple(sorted(best.values(), key=lambda s: -signed_rho(s)))


def _hidden(found: Sequence[Candidate], glimpsed: Sequence[ScoreResult]) -> set[Candidate]:
    """Linear elements that a first look cannot tell from what adjusting does, and a longer one may.

    A damper between wheelset and track in yaw is at one speed V the same as creep: kappa_x + V c / (2 b^2 N), with
    lambda kappa_x as it was. The speed along the run tells them apart, and the first seconds have one speed.
    """
    clear = {s.candidate for s in glimpsed if s.own >= VANISHED}
    return {c for c in found if c.kind in LINEAR and c not in clear}


class ScoreTest:
    """Residual and sensitivities of a fit on some stretches, against which candidates are seen."""

    def __init__(self, fit: Fit, ready: Sequence[FitSegment]) -> None:
        self.adjuster = GaussNewton(fit.model, fit.free, ready, block=1.0, stable=False, jobs=1)
        self.adjuster.restart_windows(fit.x)
        self.fit = replace(fit, segments=tuple(self.adjuster.segments))
        seconds = block_seconds(fit.model, [t.segment for t in fit.segments])
        length = [block_length(seconds, t) for t in ready]
        self.bases = [_base(self.adjuster, self.fit, i, length[i]) for i in range(len(ready))]
        inner = np.concatenate([b.blocks @ b.blocks.transpose(0, 2, 1) for b in self.bases])  # [block, 1 + p, 1 + p]
        variance = residual_variance(inner.sum(axis=0)[0, 0], sum(t.measured.size for t in ready))
        self.solver = Projector(inner, np.diag(variance / fit.free.prior_sd**2))
        self.count = sum(len(b.blocks) for b in self.bases)

    def run(self, found: Sequence[Candidate], jobs: int | None, watch: Watch) -> tuple[ScoreResult, ...]:
        """Every shape of every candidate."""
        work, parts = batch_candidates(found), list[list[ScoreResult]]()
        for part in map_threads(self._look, work, jobs):
            parts.append(part)
            watch(ScoreTestProgress(len(parts), len(work), tuple(part)))
        return tuple(s for part in parts for s in part)

    def _look(self, bundle: CandidateBatch) -> list[ScoreResult]:
        """Score every lane of a bundle."""
        sound = np.ones(len(bundle.lanes), dtype=bool)
        series = []
        for i in range(len(self.bases)):
            one, fine = output_differences(self.fit, i, bundle)
            series.append(one)
            sound &= fine
        lanes = bundle.lanes
        if bundle.members[0].phased:
            return self._turned(lanes[::2], bundle, series, sound[::2] & sound[1::2])
        seen = self.against(series, FAINT if _linear(bundle) else VANISHED)
        return [
            seen.sighting(bundle.members[member], shape, lane)
            for lane, (member, shape) in enumerate(lanes)
            if sound[lane] and seen.told[lane]
        ]

    def _turned(
        self,
        lanes: Sequence[tuple[int, int]],
        bundle: CandidateBatch,
        series: Sequence[FloatArray],
        sound: NDArray[np.bool_],
    ) -> list[ScoreResult]:
        """Score what turns, each stretch with the phase of its own that explains most; series in sine and cosine."""
        places = [t.segment.segment_key for t in self.fit.segments]
        middles = dict(places)
        phases = self._phases(series)  # [lane, place], at distance 0
        index = [list(middles).index(where) for where, _ in places]

        def combined(quadrature: float) -> list[FloatArray]:
            angles = [phases[:, i, None, None] + quadrature for i in index]
            return [np.cos(p) * one[::2] + np.sin(p) * one[1::2] for p, one in zip(angles, series, strict=True)]

        seen, beside = self.against(combined(0.0)), self.against(combined(QUADRATURE))
        where = np.repeat(index, [len(b.blocks) for b in self.bases])
        found = []
        for lane, (member, shape) in enumerate(lanes):
            if sound[lane] and seen.told[lane]:
                candidate = bundle.members[member]
                turned = less_turns(phases[lane] + np.array(list(middles.values())) / candidate.shapes[shape][RADIUS])
                own = dict(zip(middles, turned.tolist(), strict=True))
                one = seen.sighting(candidate, shape, lane)
                found.append(replace(one, phases=own, beside=beside.scores[lane], where=where))
        return found

    def _phases(self, series: Sequence[FloatArray]) -> FloatArray:
        """Phases [lane, place] of pairs in sine and cosine: all pairs of the places beside each other explain most."""
        places = [t.segment.segment_key[0] for t in self.fit.segments]
        names, lanes, own = list(dict.fromkeys(places)), len(series[0]) // 2, len(self.solver.right)
        cross = np.zeros((lanes, len(names), 2, 1 + own))
        inner = np.zeros((lanes, len(names), 2, 2))
        for where, target, base, one in zip(places, self.fit.segments, self.bases, series, strict=True):
            pairs = _rows_in_blocks(target.without_initial_state(one), base.length)  # [block, 2 lanes, sample]
            k = names.index(where)
            cross[:, k] += (pairs @ base.blocks.transpose(0, 2, 1)).sum(axis=0).reshape(lanes, 2, 1 + own)
            pairs = pairs.reshape(len(pairs), lanes, 2, -1)
            inner[:, k] += np.einsum("blin,bljn->lij", pairs, pairs)
        flat = cross.reshape(lanes, -1, 1 + own)
        left = -flat[:, :, 1:] @ self.solver.inverse @ flat[:, :, 1:].transpose(0, 2, 1)
        for k in range(len(names)):
            left[:, 2 * k : 2 * k + 2, 2 * k : 2 * k + 2] += inner[:, k]
        score = flat[:, :, 0] - flat[:, :, 1:] @ self.solver.beta
        amounts = np.einsum("lij,lj->li", np.linalg.pinv(left, rcond=VANISHED**2, hermitian=True), score)
        sine, cosine = np.moveaxis(amounts.reshape(lanes, -1, 2), 2, 0)
        return np.asarray(np.arctan2(cosine, sine))

    def against(self, series: Sequence[FloatArray], vanished: float = VANISHED) -> ProjectedScores:
        """Output differences [lane, channel, n] of every stretch against its residual, by inner products per block."""
        cross, norms = [], []
        for target, base, one in zip(self.fit.segments, self.bases, series, strict=True):
            blocks = _rows_in_blocks(target.without_initial_state(one), base.length)
            cross.append(blocks @ base.blocks.transpose(0, 2, 1))
            norms.append(np.einsum("bln,bln->bl", blocks, blocks))
        return self.solver.seen(np.concatenate(cross), np.concatenate(norms), vanished)


def _base(adjuster: GaussNewton, fit: Fit, index: int, length: int) -> _Base:
    target = fit.segments[index]
    series, _ = adjuster.sensitivities(target, fit.x)
    return _Base(_rows_in_blocks(series, length), length)


def _rows_in_blocks(series: FloatArray, length: int) -> FloatArray:
    """Series [row, channel, n] as [block, row, channel x sample]."""
    blocks = split_into_blocks(series, length).transpose(2, 0, 1, 3)
    return np.ascontiguousarray(blocks.reshape(len(blocks), len(series), -1))


def output_differences(fit: Fit, index: int, bundle: CandidateBatch) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Output differences per amount [lane, channel, n] of a bundle on a stretch, and which lanes are sound."""
    amount = LITTLE if _linear(bundle) else AMOUNT
    target = fit.segments[index]
    model = fit.model.on(*target.segment.segment_key)
    numbers, amounts = bundle.numbers(), bundle.amounts(amount)
    numbers = np.vstack([numbers[:1], numbers])
    amounts = np.vstack([np.zeros_like(amounts[:1]), amounts])
    vehicles = model.vehicles(target.segment.coach_forces, bundle.placements)
    batch = model.batch(np.tile(model.row, (len(numbers), 1)), numbers, amounts)
    steps = _steps(vehicles, batch, target)
    sound = steps > 0
    sound[0] = True
    if not sound[1:].any():
        return np.zeros((len(numbers) - 1, *target.measured.shape)), np.zeros(len(numbers) - 1, dtype=bool)
    # steps hold for motions much wilder than those here, and a little of an effect moves the vehicle little
    used = min(max(int(steps.max()), target.steps), FINEST * target.steps)
    start = target.initial_state if vehicles.states(batch.select([0])) >= len(target.initial_state) and not _grows(bundle) else None
    series, lost = simulate(
        model,
        target.segment,
        target.segment.channels,
        batch=batch.select(np.flatnonzero(sound)),
        vehicles=vehicles,
        steps=used,
        filter=target.filter,
        initial=start,
    )
    full = np.zeros((len(numbers), *series.shape[1:]))
    full[sound] = series
    fine = sound.copy()
    fine[np.flatnonzero(sound)[lost >= 0]] = False
    out = (full[1:] - full[0]) / amount
    out[~fine[1:]] = 0.0
    return out, fine[1:] & fine[0]


def _linear(bundle: CandidateBatch) -> bool:
    return bundle.members[0].kind in LINEAR


def _grows(bundle: CandidateBatch) -> bool:
    return bundle.members[0].kind == "coach_mode"


def _steps(vehicles: Vehicles, batch: Batch, target: FitSegment) -> NDArray[np.int64]:
    """Steps per sample that each vehicle needs; -1 where too many."""
    try:
        return np.array(vehicles.steps(batch, *target.segment.speeds, target.segment.dt))
    except ValueError:
        if len(batch) == 1:
            return np.array([-1])
        return np.concatenate([_steps(vehicles, batch.select([i]), target) for i in range(len(batch))])
