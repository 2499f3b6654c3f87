"""The trace: a little of every candidate effect beside the adjusted vehicle, correlated with the residual.

The output difference of two parallel models, after what the adjustable parameters absorb has been projected
out, against the residual: a partial rho (Broersen 1976, ch. 5 and 6; the score test of statistics).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from railui.core import Batch, Vehicles
from railui.study.adjust import Adjuster, Fit, block_seconds, variance_of
from railui.study.beside import beside
from railui.study.blocks import in_blocks, samples_of
from railui.study.candidates import QUADRATURE, Bundle, Candidate, bundles
from railui.study.measured import simulate
from railui.study.model import RADIUS, less_turns
from railui.study.target import Target
from railui.study.watch import Looked, Watch, unwatched

Floats = NDArray[np.float64]
AMOUNT = 0.05  # of a candidate beside the adjusted vehicle
BOOTSTRAPS = 2000
POWER = 1.2816  # normal quantile of 90 % power
KEPT = 12  # candidates that are seen on the whole of the runs after a first look
FINEST = 4  # times the steps of the adjusted vehicle that a little of an effect is looked at with
LEAST_FREEDOM = 1.0
LONELY = 1e-6  # share of all other blocks below which one block is alone
VANISHED = 1e-3  # share of a difference left by the projection below which nothing new is in it


@dataclass(frozen=True, eq=False)
class Sighting:
    """One shape of a candidate seen against the residual.

    rho: partial correlation; amount: of it that would explain the residual best; explained: share of the squared
    residual; scores [block]: what each block of time says; norm: squared length of its difference, norms [block] the
    same of every block (empty: all alike); absorbed [p]: what the adjustable parameters make of one of it; phases:
    the angle [rad] of what turns in the middle of each stretch, by which it explains most; beside [block]: the scores
    in quadrature to it, where [block]: the stretch of each block.
    """

    candidate: Candidate
    shape: int
    rho: float
    amount: float
    scores: Floats
    norm: float
    absorbed: Floats = field(default_factory=lambda: np.zeros(0), repr=False)
    norms: Floats = field(default_factory=lambda: np.zeros(0), repr=False)
    phases: Mapping[str, float] = field(default_factory=dict)
    beside: Floats = field(default_factory=lambda: np.zeros(0), repr=False)
    where: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64), repr=False)

    @property
    def z(self) -> float:
        """The score over its standard deviation from blocks (HAC), in standard deviations of a normal variable."""
        spread = self.spread
        return float(as_normal(self.scores.sum() / spread, self.freedom)) if spread > 0 else 0.0

    def forecast(self, ratio: float, blocks: int) -> Sighting:
        """What a run so many times as long, of so many blocks, would say."""
        per_block = {"scores": self.scores, "norms": self.norms, "beside": self.beside, "where": self.where}
        resized = {name: np.resize(x, blocks) for name, x in per_block.items() if x.size}
        return replace(self, norm=ratio * self.norm, **resized)  # type: ignore[arg-type]

    @property
    def leverage(self) -> Floats:
        """Share [block] of a block in what is known of the amount; an effect that acts now and then is in few."""
        if not self.norms.size:
            return np.full(len(self.scores), 1.0 / len(self.scores))
        return np.asarray(self.norms / max(self.norms.sum(), 1e-300))

    @property
    def noise(self) -> Floats:
        """Scores [block] less what the effect makes of them, its amount estimated without that block.

        s_b - a_b n_b with a_b = sum of the other s / sum of the other n, n_b the squared length in the block: the
        residuals of least squares left out one at a time, of which the variance is consistent whatever the noise
        (HC3: MacKinnon and White, J. Econometrics 29 (1985) 305). Scores less their mean would count it as noise
        that an effect speaks in few blocks and is silent in others.
        """
        h = self.leverage
        return np.asarray((self.scores - h * self.scores.sum()) / np.maximum(1.0 - h, LONELY))

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the spread: blocks that speak, less one."""
        return max(float(1.0 / np.sum(self.leverage**2)) - 1.0, LEAST_FREEDOM)

    @property
    def spread(self) -> float:
        """Standard deviation of the score, from blocks."""
        return float(np.linalg.norm(self.noise))

    def amount_seen(self, z: float) -> float:
        """The amount whose score is so many standard deviations of a normal variable."""
        n = self.freedom
        t = float(np.sqrt(n * np.expm1((z * (8 * n + 3) / (8 * n + 1)) ** 2 / n)))
        return t * self.spread / self.norm


def as_normal(t: Floats | float, freedom: Floats | float) -> Floats:
    """Student's t as the normal variable of the same probability (Wallace, Ann. Math. Statist. 30 (1959) 1121).

    >>> as_normal(3.143, 6.0).round(2), as_normal(-2.326, 1e9).round(3)  # one in a hundred: 2.326
    (np.float64(2.32), np.float64(-2.326))
    """
    n = np.asarray(freedom)
    return np.asarray(np.sign(t) * (8 * n + 1) / (8 * n + 3) * np.sqrt(n * np.log1p(np.square(t) / n)))


@dataclass(frozen=True, eq=False)
class Trace:
    """All sightings, the best of each candidate first; family-wise p; the misfit that was searched."""

    sightings: tuple[Sighting, ...]
    best: tuple[Sighting, ...]
    p: float
    critical: float
    rss: float

    @property
    def rho2(self) -> float:
        """Share of the squared residual that the best candidate explains."""
        return max((signed(s) ** 2 for s in self.best), default=0.0)


def signed(s: Sighting) -> float:
    """rho as evidence: one-sided candidates count a negative one as none."""
    return max(s.rho, 0.0) if s.candidate.one_sided else abs(s.rho)


@dataclass(frozen=True, eq=False)
class _Base:
    """Residual and sensitivities of the adjusted vehicle in blocks [block, 1 + p, sample] of one stretch."""

    blocks: Floats
    length: int


def trace(
    fit: Fit,
    found: Sequence[Candidate],
    *,
    first: Sequence[Target] = (),
    jobs: int | None = None,
    seed: int = 0,
    watch: Watch = unwatched,
) -> Trace:
    """See every candidate against the residual of a fit.

    Where `first` holds shortened stretches, all candidates are seen on them and only the best on all of the fit's; what
    the others would have said there is forecast, for what could have been seen.
    """
    whole = Eye(fit, fit.targets)
    if not first or sum(t.y.size for t in first) >= 0.7 * sum(t.y.size for t in fit.targets):
        sightings = near = whole.see(found, jobs, watch)
    else:
        glimpse = Eye(fit, first)
        glimpsed = glimpse.see(found, jobs, watch)
        kept = {s.candidate for s in _ranked(glimpsed)[:KEPT]}
        near = whole.see([c for c in found if c in kept], jobs, watch)
        ratio = sum(t.y.size for t in fit.targets) / sum(t.y.size for t in first)
        far = [s.forecast(ratio, whole.count) for s in glimpsed if s.candidate not in kept]
        sightings = (*near, *far)
    p, critical = family_wise(sightings, seed, near)
    return Trace(tuple(sightings), _ranked(sightings), p, critical, whole.solver.rest)


def _ranked(sightings: Sequence[Sighting]) -> tuple[Sighting, ...]:
    """The best shape of each candidate, best first."""
    best: dict[Candidate, Sighting] = {}
    for s in sightings:
        if s.candidate not in best or signed(s) > signed(best[s.candidate]):
            best[s.candidate] = s
    return tuple(sorted(best.values(), key=lambda s: -signed(s)))


class Eye:
    """Residual and sensitivities of a fit on some stretches, against which candidates are seen."""

    def __init__(self, fit: Fit, ready: Sequence[Target]) -> None:
        self.adjuster = Adjuster(fit.model, fit.free, ready, block=1.0, stable=False, jobs=1)
        self.adjuster.begin(fit.x)
        self.fit = replace(fit, targets=tuple(self.adjuster.ready))
        seconds = block_seconds(fit.model, [t.stretch for t in fit.targets])
        length = [samples_of(seconds, t) for t in ready]
        self.bases = [_base(self.adjuster, self.fit, i, length[i]) for i in range(len(ready))]
        self.inner = np.concatenate(
            [b.blocks @ b.blocks.transpose(0, 2, 1) for b in self.bases]
        )  # [block, 1 + p, 1 + p]
        gram = self.inner.sum(axis=0)
        variance = variance_of(gram[0, 0], sum(t.y.size for t in ready))
        self.solver = _Projector(gram, np.diag(variance / fit.free.prior_sd**2))
        self.count = sum(len(b.blocks) for b in self.bases)

    def see(self, found: Sequence[Candidate], jobs: int | None, watch: Watch) -> tuple[Sighting, ...]:
        """Every shape of every candidate."""
        work, parts = bundles(found), list[list[Sighting]]()
        for part in beside(self._look, work, jobs):
            parts.append(part)
            watch(Looked(len(parts), len(work), tuple(part)))
        return tuple(s for part in parts for s in part)

    def _look(self, bundle: Bundle) -> list[Sighting]:
        """Score every lane of a bundle."""
        sound = np.ones(len(bundle.lanes), dtype=bool)
        series = []
        for i in range(len(self.bases)):
            one, fine = differences(self.fit, i, bundle)
            series.append(one)
            sound &= fine
        lanes = bundle.lanes
        if bundle.members[0].phased:
            return self._turned(lanes[::2], bundle, series, sound[::2] & sound[1::2])
        seen = self.against(series)
        return [
            _sighting(bundle.members[member], shape, seen, lane)
            for lane, (member, shape) in enumerate(lanes)
            if sound[lane] and seen.told[lane]
        ]

    def _turned(
        self, lanes: Sequence[tuple[int, int]], bundle: Bundle, series: Sequence[Floats], sound: NDArray[np.bool_]
    ) -> list[Sighting]:
        """Score what turns, each stretch with the phase of its own that explains most; series in sine and cosine."""
        places = [t.stretch.place for t in self.fit.targets]
        middles = dict(places)
        phases = self._phases(series)  # [lane, place], at distance 0
        index = [list(middles).index(where) for where, _ in places]

        def combined(quadrature: float) -> list[Floats]:
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
                one = _sighting(candidate, shape, seen, lane)
                found.append(replace(one, phases=own, beside=beside.scores[lane], where=where))
        return found

    def _phases(self, series: Sequence[Floats]) -> Floats:
        """Phases [lane, place] of pairs in sine and cosine: all pairs of the places beside each other explain most."""
        places = [t.stretch.place[0] for t in self.fit.targets]
        names, lanes, own = list(dict.fromkeys(places)), len(series[0]) // 2, len(self.solver.right)
        cross = np.zeros((lanes, len(names), 2, 1 + own))
        inner = np.zeros((lanes, len(names), 2, 2))
        for where, target, base, one in zip(places, self.fit.targets, self.bases, series, strict=True):
            pairs = _rows_in_blocks(target.free_of(one), base.length)  # [block, 2 lanes, sample]
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

    def against(self, series: Sequence[Floats]) -> Seen:
        """Output differences [lane, channel, n] of every stretch against its residual, by inner products per block."""
        cross, norms = [], []
        for target, base, one in zip(self.fit.targets, self.bases, series, strict=True):
            blocks = _rows_in_blocks(target.free_of(one), base.length)
            cross.append(blocks @ base.blocks.transpose(0, 2, 1))
            norms.append(np.einsum("bln,bln->bl", blocks, blocks))
        with_base, solver, inner = np.concatenate(cross), self.solver, self.inner  # [block, lane, 1 + p]
        total = with_base.sum(axis=0)
        beta = total[:, 1:] @ solver.inverse
        whole = np.concatenate(norms)  # [block, lane]
        each = whole - 2 * np.einsum("lp,blp->bl", beta, with_base[:, :, 1:])
        each = each + np.einsum("blp,lp->bl", np.einsum("lp,bpq->blq", beta, inner[:, 1:, 1:]), beta)
        left = each.sum(axis=0)
        told = left > VANISHED * np.maximum(whole.sum(axis=0), 1e-300)
        left = np.where(told, left, 1.0)
        scores = with_base[:, :, 0] - inner[:, 1:, 0] @ beta.T - with_base[:, :, 1:] @ solver.beta
        scores = (scores + np.einsum("bpq,lp,q->bl", inner[:, 1:, 1:], beta, solver.beta)).T
        projection = scores.sum(axis=1)
        rho = projection / np.sqrt(left * max(solver.rest, 1e-300))
        return Seen(rho, projection / left, scores, left, beta, told, np.maximum(each.T, 0.0))


def _sighting(candidate: Candidate, shape: int, seen: Seen, lane: int) -> Sighting:
    """One lane of what was seen."""
    rho, amount, left = (float(x[lane]) for x in (seen.rho, seen.amount, seen.left))
    return Sighting(candidate, shape, rho, amount, seen.scores[lane], left, seen.absorbed[lane], seen.norms[lane])


@dataclass(frozen=True, eq=False)
class Seen:
    """Lanes seen against a residual: rho, amount, scores [lane, block], what is left of a difference, and told.

    absorbed [lane, p]: what the adjustable parameters make of one; told: is anything left after that? norms [lane,
    block]: what is left, block by block.
    """

    rho: Floats
    amount: Floats
    scores: Floats
    left: Floats
    absorbed: Floats
    told: NDArray[np.bool_]
    norms: Floats


class _Projector:
    """Takes off what the adjustable parameters absorb, by inner products alone."""

    def __init__(self, gram: Floats, precision: Floats) -> None:
        self.inner, self.right = gram[1:, 1:] + precision, gram[1:, 0]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(self.inner), 1e-300))
        self.inverse = linalg.pinvh(self.inner * np.outer(scale, scale), rtol=1e-10) * np.outer(scale, scale)
        self.beta = self.inverse @ self.right
        self.rest = float(gram[0, 0] - self.right @ self.beta)


def _base(adjuster: Adjuster, fit: Fit, index: int, length: int) -> _Base:
    target = fit.targets[index]
    series, _ = adjuster.sensitivities(target, fit.x)
    return _Base(_rows_in_blocks(series, length), length)


def _rows_in_blocks(series: Floats, length: int) -> Floats:
    """Series [row, channel, n] as [block, row, channel x sample]."""
    blocks = in_blocks(series, length).transpose(2, 0, 1, 3)
    return np.ascontiguousarray(blocks.reshape(len(blocks), len(series), -1))


def differences(fit: Fit, index: int, bundle: Bundle, amount: float = AMOUNT) -> tuple[Floats, NDArray[np.bool_]]:
    """Output differences per amount [lane, channel, n] of a bundle on a stretch, and which lanes are sound."""
    target = fit.targets[index]
    model = fit.model.on(*target.stretch.place)
    numbers, amounts = bundle.numbers(), bundle.amounts(amount)
    numbers = np.vstack([numbers[:1], numbers])
    amounts = np.vstack([np.zeros_like(amounts[:1]), amounts])
    vehicles = model.vehicles(target.stretch.coach_forces, bundle.placements)
    batch = model.batch(np.tile(model.row, (len(numbers), 1)), numbers, amounts)
    steps = _steps(vehicles, batch, target)
    sound = steps > 0
    sound[0] = True
    if not sound[1:].any():
        return np.zeros((len(numbers) - 1, *target.y.shape)), np.zeros(len(numbers) - 1, dtype=bool)
    # steps hold for motions much wilder than those here, and a little of an effect moves the vehicle little
    used = min(max(int(steps.max()), target.steps), FINEST * target.steps)
    start = target.start if vehicles.states(batch.select([0])) >= len(target.start) and not _grows(bundle) else None
    series, lost = simulate(
        model,
        target.stretch,
        target.stretch.channels,
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


def _places(where: NDArray[np.int64]) -> list[NDArray[np.bool_]]:
    """Which blocks lie on each stretch."""
    return [where == k for k in np.unique(where)]


def _grows(bundle: Bundle) -> bool:
    return bundle.members[0].kind == "coach_mode"


def _steps(vehicles: Vehicles, batch: Batch, target: Target) -> NDArray[np.int64]:
    """Steps per sample that each vehicle needs; -1 where too many."""
    try:
        return np.array(vehicles.steps(batch, *target.stretch.speeds, target.stretch.dt))
    except ValueError:
        if len(batch) == 1:
            return np.array([-1])
        return np.concatenate([_steps(vehicles, batch.select([i]), target) for i in range(len(batch))])


def family_wise(
    sightings: Sequence[Sighting], seed: int, seen_well: Sequence[Sighting] | None = None
) -> tuple[float, float]:
    """p of the best score against the maximum over the library, and the critical score at 1 %.

    The best score is that of `seen_well` (all where None). Under "nothing missing" what noise says in the blocks is
    given random signs (wild bootstrap of blocks).
    """
    if not sightings:
        return 1.0, float("inf")
    noise = np.array([s.noise for s in sightings])
    spread = np.maximum(np.linalg.norm(noise, axis=1, keepdims=True), 1e-300)
    noise /= spread
    one = np.array([s.candidate.one_sided for s in sightings])
    well = sightings if seen_well is None else seen_well
    seen = np.array([s.z if s.candidate.one_sided else abs(s.z) for s in well])
    rng = np.random.default_rng(np.random.SeedSequence([seed, 11]))
    signs = rng.choice([-1.0, 1.0], size=(BOOTSTRAPS, noise.shape[1]))
    drawn = signs @ noise.T
    for i, s in enumerate(sightings):
        if s.beside.size:  # what turns finds in noise, too, the phase of every stretch that suits it
            both = np.stack([noise[i], s.beside / spread[i]])
            drawn[:, i] = sum(np.linalg.norm(signs[:, at] @ both[:, at].T, axis=1) for at in _places(s.where))
    # each draw over its own spread, as the score that was seen is over its own
    h = np.array([s.leverage for s in sightings])
    w = 1.0 / np.maximum(1.0 - h, LONELY) ** 2
    square = (
        np.sum(w * noise**2, axis=1) - 2 * drawn * (signs @ (w * h * noise).T) + drawn**2 * np.sum(w * h * h, axis=1)
    )
    drawn = as_normal(drawn / np.sqrt(np.maximum(square, LONELY)), np.array([s.freedom for s in sightings]))
    highest = np.where(one, drawn, np.abs(drawn)).max(axis=1)
    p = (1 + int(np.sum(highest >= seen.max()))) / (1 + BOOTSTRAPS)
    return p, float(np.quantile(highest, 0.99))
