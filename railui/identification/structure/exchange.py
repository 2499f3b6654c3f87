"""Exchange of effects: a law that was the best while another effect was missing need not be the best with it.

Sequential replacement (Miller, Subset Selection in Regression, 2nd ed. 2002, 3.4): each selected effect is compared
once more, with all the others in the model, with laws that later steps tried at its place and with the candidates that
were nearly as good at its step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.elimination import effect_index
from railui.identification.structure.refit import Refit, simplest_refit
from railui.identification.structure.stage import SelectionStep, Stage
from railui.identification.structure.substitution import fit_in_place, refit_of, substitute
from railui.vehicle.effects import PlacedEffect


def exchange_effects(context: Context, final: Stage, steps: list[SelectionStep], finish: Callable[[Fit], Fit]) -> Stage:
    """Exchange effects for candidates that fit better with the other effects in the model; updates `steps`.

    A single effect was compared with all others at its step.

    finish: fits a model to the end.
    """
    if sum(s.added is not None for s in steps) < 2:
        return final
    return substitute(context, final, steps, finish, lambda fit, i: _exchanged_refit(context, fit, steps, i), 1.0)


def alternatives(context: Context, steps: Sequence[SelectionStep], index: int) -> list[Refit]:
    """Select the refits with which the effect of a step is compared: laws at its place that later steps tried first.

    After them come those of its own step that were nearly as good, the best first.
    """
    step = steps[index]  # both steps of a pair have the same refits
    c = None if step.added is None else step.added.candidate
    if c is None:
        return []
    after = [s.refits for s in steps[index + 1 :] if s.refits is not step.refits]
    later = [r for refits in after for r in refits if r.candidate != c and _place(r.candidate) == _place(c)]
    limit = context.settings.refit.give_up_ratio * min((r.rss for r in step.refits if r.candidate == c), default=0.0)
    near = [r for r in step.refits if r.candidate not in (None, c) and r.rss <= limit]
    by_candidate: dict[Candidate | None, Refit] = {}
    for refit in [*sorted(later, key=lambda r: r.rss), *sorted(near, key=lambda r: r.rss)]:
        by_candidate.setdefault(refit.candidate, refit)
    return list(by_candidate.values())


def _place(candidate: Candidate | None) -> tuple[str, int | None] | None:
    """Location and wheelset of a candidate."""
    return None if candidate is None else (candidate.at, candidate.wheelset)


def _exchanged_refit(context: Context, fit: Fit, steps: list[SelectionStep], i: int) -> Refit | None:
    """Return the refit of the alternative that is selected before the effect of a step; None: that one is.

    Updates the alternatives of the step. Those are fitted to their end that may be indistinguishable from its effect.
    """
    current = steps[i].added
    index = None if current is None or current.candidate is None else effect_index(fit.model, current.candidate)
    if current is None or index is None:
        return None
    found = [refit_of(context, fit, current)]
    settings = context.settings.selection
    ratio = settings.simpler_misfit_ratio
    limit = max(ratio, settings.indistinguishable_ratio**2)
    for r in alternatives(context, steps, i)[: settings.exchanged_candidates]:
        effect = _new_effect(fit, r)
        other = None if effect is None else fit_in_place(context, fit, index, effect, limit)
        if other is not None:
            found.append(refit_of(context, other, r))
    if len(found) > 1:
        steps[i] = replace(steps[i], alternatives=tuple(found))
    chosen = simplest_refit(sorted(found, key=lambda r: r.rss), ratio)
    return None if chosen is found[0] else chosen


def _new_effect(fit: Fit, refit: Refit) -> PlacedEffect | None:
    """Return the effect of a refit; None where a model has it already, or where it has a phase in each run."""
    candidate = refit.candidate
    if candidate is None or effect_index(fit.model, candidate) is not None or refit.fit.model.run_dependent_paths():
        return None
    index = effect_index(refit.fit.model, candidate)
    return None if index is None else refit.fit.model.effects[index]
