"""Exchange of effects: a law that was the best while another effect was missing need not be the best with it.

Sequential replacement (Miller, Subset Selection in Regression, 2nd ed. 2002, 3.4): each selected effect is compared
once more, with all the others in the model, with laws that later steps tried at its place and with the candidates that
were nearly as good at its step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.elimination import effect_index
from railui.identification.structure.refit import Refit, cross_validation_errors, simplest_refit
from railui.identification.structure.stage import SelectionStep, Stage
from railui.identification.structure.substitution import fit_in_place, substitute
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
    step = steps[index]
    c = None if step.added is None else step.added.candidate
    if c is None:
        return []
    others = [[r for r in s.refits if r.candidate not in (None, c)] for s in steps]
    later = [r for some in others[index + 1 :] for r in some if _place(r.candidate) == _place(c)]
    limit = context.settings.refit.give_up_ratio * min((r.rss for r in step.refits if r.candidate == c), default=0.0)
    own = [r for r in others[index] if r.rss <= limit]
    return [*sorted(later, key=lambda r: r.rss), *sorted(own, key=lambda r: r.rss)]


def _place(candidate: Candidate | None) -> tuple[str, int | None] | None:
    """Location and wheelset of a candidate."""
    return None if candidate is None else (candidate.at, candidate.wheelset)


def _exchanged_refit(context: Context, fit: Fit, steps: Sequence[SelectionStep], i: int) -> Refit | None:
    """Return the refit of the alternative that is selected before the effect of a step; None: that one is."""
    current = steps[i].added
    index = None if current is None or current.candidate is None else effect_index(fit.model, current.candidate)
    if current is None or index is None:
        return None
    found = [Refit(current.candidate, fit, current.block_errors)]
    ratio = context.settings.selection.simpler_misfit_ratio
    for r in alternatives(context, steps, i)[: context.settings.selection.exchanged_candidates]:
        effect = _new_effect(fit, r)
        other = None if effect is None else fit_in_place(context, fit, index, effect, ratio)
        if other is not None:
            errors = cross_validation_errors(context.settings.refit, other)
            found.append(Refit(r.candidate, other, errors, r.score_result))
    chosen = simplest_refit(sorted(found, key=lambda r: r.rss), ratio)
    return None if chosen is found[0] else chosen


def _new_effect(fit: Fit, refit: Refit) -> PlacedEffect | None:
    """Return the effect of a refit; None where a model has it already, or where it has a phase in each run."""
    candidate = refit.candidate
    if candidate is None or effect_index(fit.model, candidate) is not None or refit.fit.model.run_dependent_paths():
        return None
    index = effect_index(refit.fit.model, candidate)
    return None if index is None else refit.fit.model.effects[index]
