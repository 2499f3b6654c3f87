"""What differs from run to run: a parameter of which the validating runs ask another value than the adjusting ones.

A vehicle that is adjusted to its floor on some runs and leaves more on the others is not the same vehicle there: a
damper fades as it heats, rubber stiffens with cold, rails are worn elsewhere. No fit sees the validating runs, so what
is found here never lowers the error that is reported: it says where something acts that the model does not have.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.campaign.dataset import Dataset
from railui.identification.estimation.block_products import block_gram
from railui.identification.estimation.free_parameters import free_parameters
from railui.identification.estimation.initial_state import estimate_phases
from railui.identification.estimation.multiple_shooting import unstable_segments
from railui.identification.estimation.output_error import STABLE, Fit, GaussNewton, residual_variance
from railui.identification.estimation.problem import FitSegment, prepare_segments
from railui.identification.estimation.validation import Validation, validate_each
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.drift import parameter_groups
from railui.identification.structure.evidence import ScoreResult, family_wise_test
from railui.identification.structure.projection import Projector
from railui.vehicle.model import Model

SIGNIFICANT = 0.01  # family-wise p from which a parameter is believed to differ
REACH = np.linspace(0.2, 3.2, core.LANES)  # of the linear estimate of a change, tried side by side
# what a vehicle has at its suspensions, whether it is adjusted or not
SUSPENSIONS = tuple(
    f"vehicle.{where}"
    for where in (
        "primary.lateral_stiffness", "primary.longitudinal_stiffness", "secondary.lateral_stiffness",
        "secondary.yaw_stiffness", "secondary.lateral_damping", "secondary.yaw_damping",
    )
)  # fmt: skip


@dataclass(frozen=True)
class Shift(Candidate):
    """A parameter (kind: its path) with its twins in proportion, of another value on one run than on all others."""

    ratios: tuple[tuple[str, float], ...] = ()
    run: int = 0

    @property
    def one_sided(self) -> bool:
        """It may be higher or lower."""
        return False


@dataclass(frozen=True)
class RunEstimate:
    """A parameter on one run (its number, file, role, mean speed [m/s]): as adjusted, or as a validating run asks for
    it with all else as adjusted.
    """

    run: int
    file: str
    role: str
    speed: float
    value: float
    sd: float


@dataclass(frozen=True, eq=False)
class RunDependence:
    """A parameter that differs from run to run, and the error of the validating runs with values of their own.

    `ratios`: path -> ratio to the value, of the parameter itself (1) and of its twins; `p`: family-wise, of chance.
    """

    path: str
    ratios: Mapping[str, float]
    runs: tuple[RunEstimate, ...]
    p: float
    judged: Validation


def prepare_validation(fit: Fit, measurement: Dataset) -> Fit | None:
    """The vehicle of a fit on the validating runs, made ready as for a fit; None where it hunts there."""
    stretches, model = measurement.validation, fit.model
    if model.design.kind == "bogie" and unstable_segments(model, stretches, STABLE):
        return None
    for stretch in stretches:
        model = estimate_phases(model, stretch, measurement.noise)
    return replace(fit, model=model, segments=tuple(prepare_segments(model, measurement, stretches)))


def test_run_dependence(
    fit: Fit, here: Fit, measurement: Dataset, declared: Model, *, seed: int = 0, jobs: int | None = None
) -> RunDependence | None:
    """The parameter whose change from run to run explains most of what the validating runs leave; None: chance may.

    here: the vehicle of the fit as `laid` on the validating runs. A parameter may differ on each of them; what all
    others would take up, had they been adjusted to every run, is projected out. Raises ValueError where the vehicle
    diverges beside its own numbers.
    """
    if fit.model.design.kind != "bogie" or any(t.segment.window_of is not None for t in fit.segments):
        return None
    own = _Own(fit, here, declared, jobs)
    seen = own.seen()
    explained = dict[tuple[tuple[str, float], ...], float]()
    for s, shift in seen:
        explained[shift.ratios] = explained.get(shift.ratios, 0.0) + s.rho**2
    if not explained:
        return None
    ratios = max(explained, key=lambda r: explained[r])
    p, _ = family_wise_test([s for s, _ in seen], seed, [s for s, shift in seen if shift.ratios == ratios])
    if p > SIGNIFICANT:
        return None
    path, names, proportions = ratios[0][0], [p for p, _ in ratios], np.array([r for _, r in ratios])
    asked = own.asked(dict(ratios))
    known = dict(zip(fit.free.paths, fit.sd.tolist(), strict=True))
    adjusted = (fit.model.value(path), known.get(path, 0.0))
    rows = []
    for run in dict.fromkeys(s.run_index for s in measurement.segments):
        same = [s for s in measurement.segments if s.run_index == run]
        speed = float(np.mean([s.mean_speed for s in same]))
        rows.append(RunEstimate(run, same[0].file, same[0].role, speed, *asked.get(run, adjusted)))
    models = [fit.model.with_row(names, asked[s.run_index][0] * proportions) for s in measurement.validation]
    judged = validate_each(list(zip(models, measurement.validation, strict=True)), measurement)
    return RunDependence(path, dict(ratios), tuple(rows), p, judged)


class _Own:
    """Residual and sensitivities on all runs as inner products per block, those of the validating runs run by run."""

    def __init__(self, fit: Fit, here: Fit, declared: Model, jobs: int | None) -> None:
        self.fit, self.ready = fit, here.segments
        numbers = [p for p in fit.free.paths if "@" not in p and not p.startswith("sensors.")]
        values = declared.design.values
        self.paths = [*numbers, *(p for p in SUSPENSIONS if p not in numbers and values.get(p))]
        bare = replace(here.model, phases={})  # what belongs to a run was estimated on it
        free = free_parameters(bare, self.paths, declared)
        self.adjuster = GaussNewton(here.model, free, self.ready, block=fit.block, stable=False, jobs=jobs)
        self.x = np.array([fit.model.value(p) for p in self.paths])
        self.grams = [self._gram(t) for t in self.ready]

    def _gram(self, target: FitSegment) -> FloatArray:
        """Inner products [block, 1 + path, 1 + path] of a stretch."""
        series, lost = self.adjuster.sensitivities(target, self.x)
        if np.any(lost >= 0):
            raise ValueError(f"the vehicle diverges on {target.segment.file}")
        return np.asarray(block_gram(series, self.adjuster.block_samples(target)).sum(axis=1))

    def seen(self) -> list[tuple[ScoreResult, Shift]]:
        """What every parameter on every validating run says, beside all adjusted parameters on all runs."""
        fit, count = self.fit, len(self.fit.free.paths)
        into = np.zeros((1 + len(self.paths), 1 + count))  # rows here to those of the fit
        into[0, 0] = 1.0
        for j, path in enumerate(fit.free.paths):
            if path in self.paths:
                into[1 + self.paths.index(path), 1 + j] = 1.0
        inner = np.concatenate([fit.normal.gram.sum(axis=1), *(into.T @ g @ into for g in self.grams)])
        samples = fit.normal.samples + sum(t.measured.size for t in self.ready)
        variance = residual_variance(inner.sum(axis=0)[0, 0], samples)
        projector = Projector(inner, np.diag(variance / fit.free.prior_sd**2))
        shifts = [
            Shift(path, "", None, ratios=tuple(ratios.items()), run=run)
            for path, ratios in self._tried()
            for run in dict.fromkeys(t.segment.run_index for t in self.ready)
        ]
        mix = np.array([self._direction(dict(s.ratios)) for s in shifts])
        cross = np.zeros((len(inner), len(shifts), 1 + count))
        norms = np.zeros((len(inner), len(shifts)))
        first = len(fit.normal.gram)
        for t, gram in zip(self.ready, self.grams, strict=True):
            on = np.array([s.run == t.segment.run_index for s in shifts])
            part = slice(first, first + len(gram))
            cross[part] = np.where(on[:, None], mix @ gram @ into, 0.0)
            norms[part] = np.where(on, np.einsum("lp,bpq,lq->bl", mix, gram, mix), 0.0)
            first += len(gram)
        seen = projector.seen(cross, norms)
        return [(seen.sighting(s, 0, lane), s) for lane, s in enumerate(shifts) if seen.told[lane]]

    def _tried(self) -> list[tuple[str, dict[str, float]]]:
        """Every number alone, then those of both wheelsets in proportion and all creep."""
        return [*((p, {p: 1.0}) for p in self.paths), *(t for t in parameter_groups(self.fit) if len(t[1]) > 1)]

    def _direction(self, ratios: Mapping[str, float]) -> FloatArray:
        """What a change of parameters in proportion is made of [1 + path]."""
        out = np.zeros(1 + len(self.paths))
        for path, ratio in ratios.items():
            out[1 + self.paths.index(path)] = ratio
        return out

    def asked(self, ratios: Mapping[str, float]) -> dict[int, tuple[float, float]]:
        """The value that each validating run asks for, and its standard deviation from blocks; all else as adjusted."""
        c = self._direction(ratios)
        j, out = self.paths.index(next(iter(ratios))), {}
        low, high = self.adjuster.free.low[j], self.adjuster.free.high[j]
        for run in dict.fromkeys(t.segment.run_index for t in self.ready):
            own = [t for t in self.ready if t.segment.run_index == run]
            gram = np.concatenate([g for t, g in zip(self.ready, self.grams, strict=True) if t.segment.run_index == run])
            score, norm = gram[:, 0] @ c, np.einsum("p,bpq,q->b", c, gram, c)
            change = score.sum() / norm.sum()
            sd = float(np.linalg.norm(score - change * norm) / norm.sum())
            out[run] = (float(np.clip(self.x[j] + self._refined(own, c[1:], change), low, high)), sd)
        return out

    def _refined(self, own: Sequence[FitSegment], direction: FloatArray, change: float) -> float:
        """The change that leaves least on a run, of sixteen vehicles side by side round the linear estimate."""
        tried = change * REACH
        x = np.clip(self.x + tried[:, None] * direction, self.adjuster.free.low, self.adjuster.free.high)
        left = np.zeros(len(tried))
        for t in own:
            series, lost = self.adjuster.simulate(t, x)
            left += np.where(lost < 0, np.sum((series - t.measured) ** 2, axis=(1, 2)), np.inf)
        k = int(np.clip(np.argmin(left), 1, len(left) - 2))
        a, b, c = left[k - 1 : k + 2]
        bend = a - 2 * b + c
        if not np.isfinite(bend) or bend <= 0:
            return float(tried[int(np.argmin(left))])
        return float(tried[k] + np.clip(0.5 * (a - c) / bend, -1.0, 1.0) * (tried[1] - tried[0]))
