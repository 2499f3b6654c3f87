"""Confirmation: candidates that the trace named are fitted with everything else, and compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.campaign.dataset import Dataset
from railui.identification.estimation.multiple_shooting import limits_hunting
from railui.identification.estimation.output_error import Fit, fit_output_error
from railui.identification.estimation.problem import FitSegment, adapt_to_model, truncate
from railui.identification.structure.candidates import LINEAR, Candidate
from railui.identification.structure.evidence import ScoreResult, signed_rho
from railui.identification.structure.score_test import FINEST, ScoreTestResult
from railui.parallel import map_threads
from railui.progress import Report, Watch, silent, unwatched
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.model import Model

BEST = 5  # candidates that are always fitted
NEAR = 0.45  # share of the best explained rest from which a candidate is fitted too
MOST = 9
MEMORY = 0.1  # effects with states of their own are fitted from this share on
CLOSE = 1.25  # within so much of the best misfit a fit is carried to its end
COARSE, FINE = 1e-3, 3e-5
PART = 18.0  # seconds of each stretch on which candidates are fitted roughly
SETTLED = 1.10  # times the root of the misfit that noise leaves, up to which nothing is left to find
ROUGHLY = 0.01  # of the misfit without an effect that a rough fit may leave besides
FORLORN = 4.0  # times the least misfit so far at which an effect with memory is given up too
LEADING = 2  # candidates that are carried on before the others are given up against them
BEHIND = 1.6  # times the least misfit so far at which a candidate is given up after its first steps
ADJUSTED = tuple((at, None) for at in ("secondary_lateral", "secondary_yaw"))  # what adjusting does already
GUESS = 0.3  # of its shape that a one-sided effect starts from where the trace sees it backwards
SMALL = 0.3  # of the amount that the trace estimates, a start of its own
MODEST = 0.2  # of its usual strength that an absorbed element starts from
WORTH = 0.99  # of the least misfit so far that it must reach
QUICK, PATIENT = 4, 10  # steps of a rough fit; effects with memory converge slowly
# laws of one place that a little of, beside a vehicle without it, may tell apart wrongly: what sticks moves little
KIN = (
    {"dry_friction", "hysteresis", "maxwell_damper"},
    {"free_play", "bump_stop", "cubic_stiffness"},
)
FOLDS = 5
BOOTSTRAPS = 200


@dataclass(frozen=True, eq=False)
class Refit:
    """A candidate (None: nothing added) fitted to the adjusting runs, and its misfit per block left out."""

    candidate: Candidate | None
    fit: Fit
    held_out: FloatArray
    sighting: ScoreResult | None = None

    @property
    def rss(self) -> float:
        """Misfit on the adjusting runs."""
        return self.fit.normal.rss


def select_candidates(trace: ScoreTestResult, few: bool = False) -> list[ScoreResult]:
    """Sightings to confirm: the best five, all near the best, effects with memory further down; all where few.

    And the kin of the best at its place, wherever the trace has them.
    """
    top = trace.rho2
    picked: list[ScoreResult] = []
    if few:
        return list(trace.best)
    for i, s in enumerate(trace.best):
        share = signed_rho(s) ** 2 / max(top, 1e-300)
        memory = core.record(s.candidate.kind)["states"] > 0
        near = share >= (MEMORY if memory else NEAR) and len(picked) < MOST
        if i < BEST or near or _kin(trace.best[0].candidate, s.candidate):
            picked.append(s)
    return [s for s in picked if signed_rho(s) > 0]


def _kin(one: Candidate, other: Candidate) -> bool:
    """Are two candidates laws of one family at one place?"""
    together = any({one.kind, other.kind} <= family for family in KIN)
    return together and (one.at, one.wheelset) == (other.at, other.wheelset)


Start = tuple[PlacedEffect, Mapping[str, float]]


def starts(trace: ScoreTestResult, sighting: ScoreResult) -> list[Start]:
    """What a candidate starts from: its best shapes, at the amount that the trace estimates and a small one.

    Each with the phases of the stretches that the trace saw with this shape.
    """
    same = [s for s in trace.results if s.candidate == sighting.candidate]
    same.sort(key=lambda s: -signed_rho(s))
    memory = core.record(sighting.candidate.kind)["states"] > 0
    out: list[tuple[dict[str, float], Mapping[str, float]]] = []
    for s in same[: 3 if memory else 2]:
        shape = dict(s.candidate.shapes[s.shape])
        if s.candidate.strength is None:
            if core.record(s.candidate.kind)["acts"] == "sensor":
                neutral = 1.0 if "gain" in shape else 0.0
                shape = {k: neutral + s.amount * (v - neutral) for k, v in shape.items()}
            out.append((shape, s.phases))
            continue
        amount = GUESS if s.candidate.one_sided and s.amount <= 0 else s.amount
        out.append((s.candidate.scaled(shape, amount), s.phases))
    if sighting.candidate.strength is not None:
        shape, phases = out[0]
        out.append((sighting.candidate.scaled(shape, SMALL), phases))
    return [(sighting.candidate.placed(shape), phases) for shape, phases in out]


def refit_candidates(
    fit: Fit,
    trace: ScoreTestResult,
    measurement: Dataset,
    declared: Model,
    base: Sequence[str],
    *,
    unsettled: bool = False,
    jobs: int | None = None,
    report: Report = silent,
    watch: Watch = unwatched,
) -> list[Refit]:
    """Fit what the trace named; the misfits within a quarter of the best are carried to convergence. Best first.

    `unsettled`: much is left on runs that no fit has seen, so that what adjusting has absorbed is tried as well.
    """
    rough = ScreeningFits(fit, measurement, declared, base, jobs)
    picked = select_candidates(trace, few=fit.model.design.kind == "rig")
    for s in picked:
        watch(s)
    found = rough.fitted(trace, picked, report)
    for s, one in found:
        share = one.normal.rss / rough.before
        report(f"  {named(s.candidate):48s} rho {s.rho:+.3f}   misfit {share:.4f} of before")
    if unsettled and not rough.settled:
        found += rough.absorbed(trace, picked, report)
    if not found:
        return []
    near = CLOSE * min(f.normal.rss for _, f in found)
    several = sum(f.normal.rss <= near for _, f in found) > 1
    tolerance, threads = (FINE, 1) if several else (COARSE, jobs)

    def carried(one: tuple[ScoreResult, Fit]) -> Refit | None:
        """A rough fit on the whole runs: near the best to its end, else only looked at."""
        s, f = one
        close = f.normal.rss <= near
        ready = adapt_to_model(f.model, fit.segments, measurement, None if close else rough.finest)
        if f.model.design.kind == "rig":  # whose initial state a rough fit knows best
            ready = [replace(t, initial_state=short.initial_state) for t, short in zip(ready, f.segments, strict=True)]
        whole = _fitted(
            f.model, ready, measurement, declared,
            [*base, *f.model.effect_paths()], threads,
            tolerance=tolerance, most=30 if close else 0,
        )  # fmt: skip
        return None if whole is None else Refit(s.candidate, whole, cross_validation_errors(whole), s)

    found.sort(key=lambda one: one[1].normal.rss > near)  # what takes longest first
    refits = []
    for refit in map_threads(carried, found, jobs):
        if refit is not None:
            refits.append(refit)
            watch(refit)
    return sorted(refits, key=lambda r: r.rss)


def named(c: Candidate) -> str:
    """A candidate in words."""
    return f"{c.kind} at {c.at}" + (f" {c.wheelset}" if c.wheelset else "")


class ScreeningFits:
    """Quick fits of one candidate after another on the first seconds of the runs, from several starts each.

    What the data hardly see stays where it is, so that a derivative fits into one group of sixteen vehicles; a
    candidate that is far behind the best is not carried on.
    """

    def __init__(self, fit: Fit, measurement: Dataset, declared: Model, base: Sequence[str], jobs: int | None) -> None:
        self.model, self.measurement, self.declared, self.jobs = fit.model, measurement, declared, jobs
        self.short = truncate(fit.segments, measurement, PART)
        # steps hold for motions much wilder than those of a run; a rough fit takes fewer, and ends where it diverges
        self.finest = FINEST * max(t.steps for t in self.short)
        self.wild = any(t.segment.window_of is not None for t in self.short)
        unseen = dict(zip(fit.free.paths, fit.sd / fit.free.prior_sd, strict=True))
        self.base = sorted(base, key=lambda p: unseen.get(p, 0.0))
        at_rest = fit_output_error(fit.model, measurement, base, declared, ready=self.short, most=0, jobs=jobs)
        self.before = self.least = at_rest.normal.rss

    @property
    def settled(self) -> bool:
        """Is little left beyond what noise leaves? The weights are such that it leaves one per sample."""
        return self.least <= SETTLED**2 * sum(t.measured.size for t in self.short) + ROUGHLY * self.before

    def absorbed(
        self, trace: ScoreTestResult, tried: Sequence[ScoreResult], report: Report
    ) -> list[tuple[ScoreResult, Fit]]:
        """Springs and dampers fitted from the declared vehicle, where much is left whatever was added.

        Without a linear element the adjusted parameters run away to make up for it, and near where they end the trace
        sees little of it.
        """
        model, known = self._declared(), {s.candidate for s in tried}
        elements = [s for s in trace.best if s.candidate not in known and _absorbed(s.candidate)]

        def begun(s: ScoreResult) -> Fit | None:
            c = s.candidate
            effect = c.placed({str(c.strength): MODEST * c.shapes[0][str(c.strength)]})
            one = self._begun((effect, {}), model)
            # the declared vehicle is far off: its first two steps tell nothing yet
            return None if one is None else self._carried(one, QUICK)

        near = [
            (s, f)
            for s, f in zip(elements, map_threads(begun, elements, self.jobs), strict=True)
            if f is not None and f.normal.rss <= BEHIND * self.least
        ]
        found = []
        for (s, _), one in zip(near, map_threads(lambda n: self._carried(n[1], PATIENT), near, self.jobs), strict=True):
            if one.normal.rss < WORTH * self.least:
                share = one.normal.rss / self.before
                report(f"  {named(s.candidate):48s} from the declared vehicle, misfit {share:.4f} of before")
                found.append((s, one))
                self.least = one.normal.rss
        return found

    def fitted(
        self, trace: ScoreTestResult, sightings: Sequence[ScoreResult], report: Report
    ) -> list[tuple[ScoreResult, Fit]]:
        """The best of a few steps from every start of every candidate that can be simulated.

        First a few steps of all, then more of the two that lead, then of those that are not far behind them.
        """
        found = dict[ScoreResult, Fit]()
        for s, one in zip(sightings, map_threads(lambda s: self._tried(trace, s), sightings, self.jobs), strict=True):
            if one is not None:
                found[s] = one
            if self.wild:  # on windows a candidate takes seconds
                report(f"  {named(s.candidate)}: first steps on windows")
        self.least = min([self.before, *(f.normal.rss for f in found.values())])
        order = sorted(found, key=lambda s: found[s].normal.rss)
        for some in (order[:LEADING], order[LEADING:]):
            found.update(zip(some, map_threads(lambda s: self._settled(s, found[s]), some, self.jobs), strict=True))
            self.least = min([self.least, *(found[s].normal.rss for s in some)])
        return list(found.items())

    def _tried(self, trace: ScoreTestResult, s: ScoreResult) -> Fit | None:
        """The best after the first steps from every start, or nothing where no start can be simulated."""
        effects = starts(trace, s)
        begun = [self._begun(e) for e in effects]
        # a mass costs little, and a hunting vehicle without what holds it runs far away: from the declared one as well
        if self.model.design.kind == "rig" or self.wild:
            begun += [self._begun(e, self._declared()) for e in effects]
        tries = [f for f in begun if f is not None]
        if tries and self._holding(tries[0]):  # far from each other after a few steps, the starts part only later
            tries = [self._carried(f, PATIENT) for f in tries]
        return min(tries, key=lambda f: f.cost, default=None)

    def _settled(self, s: ScoreResult, fit: Fit) -> Fit:
        """A fit carried on where it may still be the best; slow ones get more steps, and more time to catch up."""
        memory = core.record(s.candidate.kind)["states"] > 0
        patient = self._holding(fit) or (memory and fit.normal.rss <= FORLORN * self.least)
        if patient or fit.normal.rss <= BEHIND * self.least:
            return self._carried(fit, PATIENT if patient else QUICK)
        return fit

    def _holding(self, fit: Fit) -> bool:
        """Does its effect hold the hunting of a vehicle that is adjusted on windows?"""
        return self.wild and limits_hunting(fit.model)

    def _declared(self) -> Model:
        """The model with its adjusted parameters back at their declared values."""
        return self.model.with_row(
            self.base, np.array([self.declared.row[self.declared.columns[p]] for p in self.base])
        )

    def _begun(self, start: Start, base: Model | None = None) -> Fit | None:
        try:
            model = (base or self.model).with_effect(*start)
            ready = adapt_to_model(model, self.short, self.measurement, self.finest)
        except ValueError:
            return None  # this start cannot be simulated: another may
        own = model.effect_paths()
        lanes = core.LANES - 1 - len(own) - len(model.run_paths())  # a stretch has one phase of each
        few = len(self.base) if self.wild else max(lanes, len(self.base) // 2)
        paths = [*self.base[:few], *own]
        return _fitted(model, ready, self.measurement, self.declared, paths, 1, tolerance=COARSE, most=2)

    def _carried(self, fit: Fit, most: int) -> Fit:
        ready = adapt_to_model(fit.model, fit.segments, self.measurement, self.finest)
        further = _fitted(
            fit.model, ready, self.measurement, self.declared, fit.free.paths, 1, tolerance=COARSE, most=most
        )
        return further if further is not None and further.cost < fit.cost else fit


def _absorbed(c: Candidate) -> bool:
    """Is it an element that adjusting can make up for, and does not stand for already?"""
    return c.strength is not None and c.kind in LINEAR and (c.at, c.wheelset) not in ADJUSTED


def _fitted(
    model: Model,
    ready: Sequence[FitSegment],
    measurement: Dataset,
    declared: Model,
    paths: Sequence[str],
    jobs: int | None,
    *,
    tolerance: float,
    most: int,
) -> Fit | None:
    try:
        return fit_output_error(
            model, measurement, paths, declared, ready=ready, tolerance=tolerance, most=most, jobs=jobs,
            stable=not limits_hunting(model),
        )  # fmt: skip
    except ValueError:
        return None


def cross_validation_errors(fit: Fit) -> FloatArray:
    """Squared misfit [block, channel] of each block with the parameters fitted on the other four fifths (linear)."""
    gram = fit.normal.gram
    blocks = len(gram)
    total = fit.normal.total
    ridge = np.diag(fit.normal.variance / fit.free.prior_sd**2)
    out = np.zeros(gram.shape[:2])
    for fold in np.array_split(np.arange(blocks), min(FOLDS, blocks)):
        left = total - gram[fold].sum(axis=(0, 1))
        a = left[1:, 1:] + ridge
        scale = 1.0 / np.sqrt(np.maximum(np.diag(a), 1e-300))
        shift = scale * (np.linalg.pinv(a * np.outer(scale, scale), rcond=1e-9) @ (scale * left[1:, 0]))
        g = gram[fold]
        out[fold] = g[..., 0, 0] - 2 * g[..., 0, 1:] @ shift + np.einsum("p,bcpq,q->bc", shift, g[..., 1:, 1:], shift)
    return out


def cross_validation_nrmse(refit: Refit) -> float:
    """nrmse of the adjusting runs, fitted on four fifths and judged on the other."""
    error = refit.held_out.sum(axis=0)
    power = np.sum([np.sum(t.measured**2, axis=1) for t in refit.fit.segments], axis=0)
    return float(np.sqrt(np.mean(error / power)))


def bootstrap_weights(refits: Sequence[Refit], seed: int) -> FloatArray:
    """Share of block bootstraps in which each fit was best, [refit]."""
    blocks = np.array([r.held_out.sum(axis=1) for r in refits])
    rng = np.random.default_rng(np.random.SeedSequence([seed, 13]))
    drawn = rng.integers(0, blocks.shape[1], size=(BOOTSTRAPS, blocks.shape[1]))
    best = np.argmin(blocks[:, drawn].sum(axis=2), axis=0)
    return np.bincount(best, minlength=len(refits)) / BOOTSTRAPS
