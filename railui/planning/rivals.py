"""Rival models of a loop: the final model and others that the data did not separate from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.settings.planning import PlanningSettings
from railui.identification.estimation.fit import Fit
from railui.identification.result import LoopResult
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.refit import Refit
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.stage import SelectionStep
from railui.io.problems import FileProblems
from railui.planning.vuong import vuong_statistic
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.load_states import STATE_PATH
from railui.vehicle.model import Model
from railui.vehicle.sampling import covariance_root

MAX_WEAK_EFFECTS = 2


@dataclass(frozen=True, eq=False)
class RivalModel:
    """A model of the data with the uncertainty of its parameters.

    Attributes
    ----------
    candidate
        The effect in which it differs from the other rivals; None: none.
    model
        The vehicle as estimated.
    paths, covariance
        Estimated parameters [p] and their covariance [p, p].
    z
        Vuong's statistic of the final model against it on the estimation runs, positive for the final model; of the
        final model 0.
    """

    candidate: Candidate | None
    model: Model
    paths: tuple[str, ...]
    covariance: FloatArray
    z: float = 0.0

    @property
    def key(self) -> dict[str, Any]:
        """Kind, location and wheelset of the effect in which it differs; of no effect None."""
        c = self.candidate
        return {"kind": c.kind if c else None, "at": c.at if c else None, "wheelset": c.wheelset if c else None}

    @cached_property
    def deviations(self) -> FloatArray:
        """Principal axes [p, k] of the correlations, in standard deviations: a root of the covariance."""
        return covariance_root(self.covariance)

    def values(self) -> FloatArray:
        """Estimates [p]."""
        return np.array([self.model.value(p) for p in self.paths])

    def with_values(self, values: FloatArray) -> Model:
        """Return the vehicle with other values [p] of the estimated parameters."""
        return self.model.with_path_values(self.paths, values)

    def in_load_state(self, state: str | None) -> RivalModel:
        """Return the rival in a load state of its design; UnitError for an unknown one."""
        if state is None:
            return self
        design = self.model.design.with_values({STATE_PATH: state})
        return replace(self, model=replace(self.model, design=design))

    def draw(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Draw values [count, p] about the estimates; one that changes its sign keeps the estimate."""
        values = self.values()
        drawn = values + rng.standard_normal((count, len(values))) @ self.deviations.T
        return np.asarray(np.where(np.sign(drawn) == np.sign(values), drawn, values))

    def without_effect(self) -> Model:
        """Return the vehicle as estimated, without the effect in which the rival differs."""
        own = [i for i, e in enumerate(self.model.effects) if (e.kind, e.at, e.wheelset) == tuple(self.key.values())]
        return self.model.without_effect(own[-1]) if own else self.model


def rival_models(result: LoopResult) -> list[RivalModel]:
    """Return the final model, then the models that come closest to it on the estimation runs.

    These are the candidates that were fitted in its last step, the model without an effect, and where nothing was
    fitted weak effects of the size that the residual prefers, to first order.
    """
    settings = result.context.settings.planning
    final = _of_fit(_last_candidate(result), result.after, 0.0)
    best = _misfits(result.after)
    fits = [(r.candidate, r.fit) for r in _other_refits(result)]
    if result.after is not result.before:
        fits.append((None, result.before))
    others = [
        _of_fit(candidate, fit, vuong_statistic(best, _misfits(fit)))
        for candidate, fit in fits
        if len(_misfits(fit)) == len(best)
    ]
    if not others:
        others = weak_effects(result.after, result.score_test.best, settings)
    return [final, *sorted(others, key=lambda r: r.z)[: settings.max_rivals]]


def undecided(rivals: Sequence[RivalModel], settings: PlanningSettings) -> list[RivalModel]:
    """Return the final model and those of the others that the data do not separate from it."""
    return [*rivals[:1], *(r for r in rivals[1:] if r.z < settings.critical_z)]


def _misfits(fit: Fit) -> FloatArray:
    """Squared weighted residuals [block] of the estimation runs."""
    return np.asarray(fit.normal.gram[:, :, 0, 0].sum(axis=1))


def _of_fit(candidate: Candidate | None, fit: Fit, z: float) -> RivalModel:
    return RivalModel(candidate, fit.model, *_shared_estimates(fit), z)


def _shared_estimates(fit: Fit) -> tuple[tuple[str, ...], FloatArray]:
    """Return paths [p] and covariance [p, p] of the estimates but for those of a single run, such as a phase."""
    shared = [i for i, p in enumerate(fit.free.paths) if "@" not in p]
    return tuple(fit.free.paths[i] for i in shared), fit.covariance[np.ix_(shared, shared)]


def _last_step(result: LoopResult) -> SelectionStep | None:
    """Return the step that added the last effect, or the last step with fits where none was added."""
    added = [s for s in result.steps if s.added is not None]
    fitted = [s for s in result.steps if s.refits]
    return added[-1] if added else fitted[-1] if fitted else None


def _last_candidate(result: LoopResult) -> Candidate | None:
    step = _last_step(result)
    return step.added.candidate if step is not None and step.added is not None else None


def _other_refits(result: LoopResult) -> list[Refit]:
    step = _last_step(result)
    if step is None:
        return []
    added = step.added.candidate if step.added is not None else None
    refits = step.refits if step.added is None else step.comparable_refits
    return [r for r in refits if r.candidate is not None and r.candidate != added]


def weak_effects(fit: Fit, scores: Sequence[ScoreResult], settings: PlanningSettings) -> list[RivalModel]:
    """Return models with an effect of the amount that explains the residual best, to first order.

    Only effects whose force is proportional to a parameter are scaled, within the range of this parameter. Their
    statistic is the score of the effect, negative since the data prefer it, though by less than the search over the
    library explains.
    """
    found: list[RivalModel] = []
    for s in sorted(scores, key=lambda s: -s.admissible_rho):
        c = s.candidate
        is_usable = (
            c.strength is not None
            and not c.has_phase
            and s.admissible_rho > 0
            and abs(s.z) > settings.weak_effect_score
        )
        if is_usable and len(found) < MAX_WEAK_EFFECTS:
            effect = c.effect_with(c.scale_force(c.shapes[s.shape], s.amount))
            x = np.clip(fit.x - s.amount * s.absorbed, fit.free.low, fit.free.high)
            shifted = fit.model.with_path_values(fit.free.paths, x)
            model = _model_with(shifted, effect)
            if model is not None:
                found.append(RivalModel(c, model, *_shared_estimates(fit), -abs(s.z)))
    return found


def _model_with(model: Model, effect: PlacedEffect) -> Model | None:
    """Return a model with an effect; None where an amount so small or large is beyond the range of its parameters."""
    try:
        return model.with_effect(effect)
    except FileProblems:
        return None


def rival_records(rivals: Sequence[RivalModel], nominal: Model, settings: PlanningSettings) -> list[dict[str, Any]]:
    """Return rivals as data: effects beyond the nominal ones, estimates and their covariance."""
    open_ones = undecided(rivals, settings)[1:]
    return [
        {
            **r.key,
            "z": r.z,
            "undecided": r in open_ones,
            "effects": [_effect_record(e) for e in r.model.design.effects[len(nominal.design.effects) :]],
            "sensors": [_effect_record(e) for e in r.model.sensors[len(nominal.sensors) :]],
            "names": list(r.paths),
            "values": r.values().tolist(),
            "covariance": (0.5 * (r.covariance + r.covariance.T)).tolist(),
        }
        for r in rivals
    ]


def _effect_record(effect: PlacedEffect) -> dict[str, Any]:
    parameters = {k: list(v) if isinstance(v, tuple) else v for k, v in effect.parameters.items()}
    return {"kind": effect.kind, "at": effect.at, "wheelset": effect.wheelset, "parameters": parameters}


def read_rivals(records: Sequence[Mapping[str, Any]], nominal: Model) -> list[RivalModel]:
    """Return the rivals of a report's records.

    Raises
    ------
    KeyError, ValueError
        For records that do not belong to the nominal model.
    """
    return [_read(record, nominal) for record in records]


def _read(record: Mapping[str, Any], nominal: Model) -> RivalModel:
    model = nominal
    for row in (*record["effects"], *record["sensors"]):
        model = model.with_effect(_read_effect(row))
    names = tuple(record["names"])
    model = model.with_path_values(names, np.array(record["values"], dtype=float))
    candidate = None if record["kind"] is None else Candidate(record["kind"], record["at"], record["wheelset"])
    return RivalModel(candidate, model, names, np.array(record["covariance"], dtype=float), float(record["z"]))


def _read_effect(row: Mapping[str, Any]) -> PlacedEffect:
    parameters = {k: tuple(v) if isinstance(v, list) else v for k, v in row["parameters"].items()}
    return PlacedEffect(row["kind"], row["at"], row["wheelset"], parameters)
