"""Confirmation: candidates that the trace named are fitted with everything else, and compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railui import core
from railui.study.adjust import Fit, Report, Target, adjust, silent
from railui.study.candidates import Candidate
from railui.study.judge import initial_state
from railui.study.measured import Measurement, filtered, steps_for
from railui.study.model import Model
from railui.study.trace import Sighting, Trace, signed
from railui.study.watch import Watch, unwatched

Floats = NDArray[np.float64]
BEST = 5  # candidates that are always fitted
NEAR = 0.45  # share of the best explained rest from which a candidate is fitted too
MOST = 9
MEMORY = 0.1  # effects with states of their own are fitted from this share on
CLOSE = 1.25  # within so much of the best misfit a fit is carried to its end
COARSE, FINE = 1e-3, 1e-6
PART = 24.0  # seconds of each stretch on which candidates are fitted roughly
FOLDS = 5
BOOTSTRAPS = 200


@dataclass(frozen=True, eq=False)
class Refit:
    """A candidate (None: nothing added) fitted to the adjusting runs, and its misfit per block left out."""

    candidate: Candidate | None
    fit: Fit
    held_out: Floats
    sighting: Sighting | None = None

    @property
    def rss(self) -> float:
        return self.fit.normal.rss


def chosen(trace: Trace) -> list[Sighting]:
    """Sightings to confirm: the best five, all near the best, and effects with memory further down."""
    top = trace.rho2
    picked: list[Sighting] = []
    for i, s in enumerate(trace.best):
        share = signed(s) ** 2 / max(top, 1e-300)
        memory = core.record(s.candidate.kind)["states"] > 0
        if i < BEST or (share >= NEAR and len(picked) < MOST) or (memory and share >= MEMORY and len(picked) < MOST):
            picked.append(s)
    return [s for s in picked if signed(s) > 0]


def retarget(model: Model, ready: Sequence[Target], measurement: Measurement) -> list[Target]:
    """The same comparison for a model of another structure: steps, and initial states where bodies were added."""
    out = []
    for t in ready:
        grown = any(e.kind == "coach_mode" for e in model.effects)
        start = initial_state(model, t.stretch, measurement.noise) if grown else t.start
        out.append(replace(t, start=start, steps=max(t.steps, steps_for(model, t.stretch))))
    return out


def starts(trace: Trace, sighting: Sighting) -> list[dict[str, float]]:
    """Starting parameters of a candidate: its best shapes, at the amount that the trace estimates and a small one."""
    same = [s for s in trace.sightings if s.candidate == sighting.candidate]
    same.sort(key=lambda s: -signed(s))
    memory = core.record(sighting.candidate.kind)["states"] > 0
    out = []
    for s in same[: 3 if memory else 2]:
        shape = dict(s.candidate.shapes[s.shape])
        key = s.candidate.strength
        if key is None:
            if core.record(s.candidate.kind)["acts"] == "sensor":
                neutral = 1.0 if "gain" in shape else 0.0
                shape = {k: neutral + s.amount * (v - neutral) for k, v in shape.items()}
            out.append(shape)
            continue
        phase = {} if s.phase is None else {"phase": s.phase}
        out.append(shape | {key: shape[key] * s.amount} | phase)
    key = sighting.candidate.strength
    if key is not None:
        out.append(out[0] | {key: 0.3 * out[0][key]})
    return out


def confirm(
    fit: Fit,
    trace: Trace,
    measurement: Measurement,
    declared: Model,
    base: Sequence[str],
    *,
    jobs: int | None = None,
    report: Report = silent,
    watch: Watch = unwatched,
) -> list[Refit]:
    """Fit what the trace named; the misfits within a quarter of the best are carried to convergence. Best first."""
    short = shortened(fit.targets, measurement)
    base_misfit = adjust(fit.model, measurement, base, declared, ready=short, most=0, jobs=jobs).normal.rss
    rough = []
    for s in chosen(trace):
        watch(s)
        found = _roughly(fit.model, short, trace, s, measurement, declared, base, jobs)
        if found is not None:
            rough.append((s, found))
            share = found.normal.rss / base_misfit
            report(f"  {_name(s.candidate):48s} rho {s.rho:+.3f}   misfit {share:.4f} of before")
    if not rough:
        return []
    least = min(f.normal.rss for _, f in rough)
    refits = []
    for s, f in rough:
        near = f.normal.rss <= CLOSE * least
        whole = _fitted(
            f.model, retarget(f.model, fit.targets, measurement), measurement, declared, f.free.paths, jobs,
            tolerance=FINE if near else COARSE, most=30 if near else 1,
        )  # fmt: skip
        if whole is not None:
            refits.append(Refit(s.candidate, whole, held_out(whole), s))
            watch(refits[-1])
    return sorted(refits, key=lambda r: r.rss)


def shortened(ready: Sequence[Target], measurement: Measurement) -> list[Target]:
    """The first part of every stretch, enough to tell candidates apart roughly."""
    out = []
    for t in ready:
        n = min(t.stretch.samples, round(PART / t.stretch.dt))
        if t.stretch.kind == "rig" or n == t.stretch.samples:
            out.append(t)
            continue
        columns = {k: np.ascontiguousarray(x[:n]) for k, x in t.stretch.columns.items()}
        stretch = replace(t.stretch, columns=columns, tables={})
        weights = t.filter.weights
        y = filtered(measurement.campaign, stretch, stretch.measured(stretch.channels))[:, :: t.filter.every]
        out.append(replace(t, stretch=stretch, y=y * weights[:, None]))
    return out


def _stable(model: Model) -> bool:
    """Must the linear base be stable? Not where an effect can hold the hunting."""
    return not any(core.record(e.kind)["acts"] in ("creep",) or e.kind == "flange_contact" for e in model.effects)


def _name(c: Candidate) -> str:
    return f"{c.kind} at {c.at}" + (f" {c.wheelset}" if c.wheelset else "")


def _roughly(
    base_model: Model,
    short: Sequence[Target],
    trace: Trace,
    s: Sighting,
    measurement: Measurement,
    declared: Model,
    base: Sequence[str],
    jobs: int | None,
) -> Fit | None:
    """The best of a few steps from every start, on the shortened runs."""
    best: Fit | None = None
    for parameters in starts(trace, s):
        try:
            model = base_model.with_effect(s.candidate.placed(parameters))
            ready = retarget(model, short, measurement)
        except ValueError:
            continue  # this start cannot be simulated: another may
        paths = [*base, *model.effect_paths()]
        found = _fitted(model, ready, measurement, declared, paths, jobs, tolerance=COARSE, most=6)
        if found is not None and (best is None or found.cost < best.cost):
            best = found
    return best


def _fitted(
    model: Model,
    ready: Sequence[Target],
    measurement: Measurement,
    declared: Model,
    paths: Sequence[str],
    jobs: int | None,
    *,
    tolerance: float,
    most: int,
) -> Fit | None:
    try:
        return adjust(
            model, measurement, paths, declared, ready=ready, tolerance=tolerance, most=most, jobs=jobs,
            stable=_stable(model),
        )  # fmt: skip
    except ValueError:
        return None


def held_out(fit: Fit) -> Floats:
    """Squared misfit [block, channel] of each block with the parameters fitted on the other four fifths (linear)."""
    gram = fit.normal.gram
    blocks = len(gram)
    total = fit.normal.total
    ridge = np.diag(1.0 / fit.free.prior_sd**2) * fit.normal.rss / fit.normal.samples
    out = np.zeros(gram.shape[:2])
    for fold in np.array_split(np.arange(blocks), min(FOLDS, blocks)):
        left = total - gram[fold].sum(axis=(0, 1))
        a = left[1:, 1:] + ridge
        scale = 1.0 / np.sqrt(np.maximum(np.diag(a), 1e-300))
        shift = scale * (np.linalg.pinv(a * np.outer(scale, scale), rcond=1e-9) @ (scale * left[1:, 0]))
        g = gram[fold]
        out[fold] = g[..., 0, 0] - 2 * g[..., 0, 1:] @ shift + np.einsum("p,bcpq,q->bc", shift, g[..., 1:, 1:], shift)
    return out


def held_out_nrmse(refit: Refit) -> float:
    """nrmse of the adjusting runs, fitted on four fifths and judged on the other."""
    error = refit.held_out.sum(axis=0)
    power = np.sum([np.sum(t.y**2, axis=1) for t in refit.fit.targets], axis=0)
    return float(np.sqrt(np.mean(error / power)))


def bootstrap_weights(refits: Sequence[Refit], seed: int) -> Floats:
    """Share of block bootstraps in which each fit was best, [refit]."""
    blocks = np.array([r.held_out.sum(axis=1) for r in refits])
    rng = np.random.default_rng(np.random.SeedSequence([seed, 13]))
    drawn = rng.integers(0, blocks.shape[1], size=(BOOTSTRAPS, blocks.shape[1]))
    best = np.argmin(blocks[:, drawn].sum(axis=2), axis=0)
    return np.bincount(best, minlength=len(refits)) / BOOTSTRAPS
