"""Search for the smallest set of faults that makes the columns of one run consistent."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from railui.campaign.corrections.correction import Corrections
from railui.campaign.faults.clocks import drifting_clock
from railui.campaign.faults.families import (
    CONTINUOUS,
    best_of_family,
    candidates,
    continuous_families,
    discrete_hypotheses,
    groups_of,
)
from railui.campaign.faults.hypotheses import Consistency, Hypothesis
from railui.campaign.faults.scores import (
    ScoredFault,
    is_consistent,
    is_evident,
    is_large,
    is_same_fault,
    penalty,
    score_continuous,
    score_discrete,
    total_misfit,
)
from railui.campaign.faults.spectra import RunSpectra
from railui.campaign.settings.faults import FaultSettings

PAIR_FREQUENCIES = 3  # every third one is used where all pairs are compared

Transform = Callable[[Corrections], RunSpectra | None]


@dataclass(frozen=True)
class Explanation:
    """A fault with its evidence (gain of the log-likelihood), standard deviation and equally good alternatives."""

    hypothesis: Hypothesis
    evidence: float
    sd: float = float("nan")
    alternatives: tuple[Hypothesis, ...] = ()


class FaultSearch:
    """Stepwise search for faults of one run, followed by a search over all pairs where several faults were found."""

    def __init__(
        self,
        settings: FaultSettings,
        transform: Transform,
        has_units: bool = True,
        rms: Mapping[str, float] | None = None,
    ) -> None:
        """Prepare the search; transform: spectra of the run with corrected columns; rms: of the columns as recorded."""
        self.settings = settings
        self.transform = transform
        self.has_units = has_units
        self.rms = rms or {}
        self.is_resolved = True

    def find(self) -> list[Explanation]:
        """Return the faults, those with most evidence first; empty without any relation."""
        found = self._stepwise(())
        serious = [e for e in found if e.hypothesis.kind not in ("gain", "delay")]
        if len(serious) > 1 or (found and not self._is_resolved(found)):
            found = self._better_pair(found) or found
        if found and not self._is_resolved(found):
            found = self._better_clock(found) or found
        found = self._simpler(found) or found
        self.is_resolved = self._is_resolved(found)
        return sorted(found, key=lambda e: -e.evidence)

    def _simpler(self, found: list[Explanation]) -> list[Explanation] | None:
        """Explain a wrong sign by a delay of half a period of the dominant motion, if that fits better."""
        single = [e.hypothesis for e in found if len(e.hypothesis.channels) == 1]
        for channel in dict.fromkeys(h.channels[0] for h in single if h.kind == "sign"):
            others = [e.hypothesis for e in found if channel not in e.hypothesis.channels]
            consistency = self._consistency(others)
            if consistency is None:
                continue
            lags = next(g for h, g in continuous_families([channel], consistency.spectra) if h.kind == "delay")
            delay = best_of_family(consistency, Hypothesis("delay", (channel,)), lags)[0]
            if (better := self._better_of(found, self._stepwise((*others, delay)))) is not None:
                return better
        return None

    def _is_resolved(self, found: Sequence[Explanation]) -> bool:
        """True if the data are consistent after all corrections."""
        consistency = self._consistency([e.hypothesis for e in found])
        return consistency is None or is_consistent(consistency, self.settings)

    def _better_clock(self, found: list[Explanation]) -> list[Explanation] | None:
        """Explain the data by a clock that drifts far, which spectra of the whole run do not show."""
        raw = self._consistency(())
        if raw is None:
            return None
        groups = groups_of(candidates(raw.spectra))
        drifts = [d for g in groups if (d := drifting_clock(raw, Hypothesis("delay", g), self.settings)) is not None]
        if not drifts:
            return None
        best = min(drifts, key=lambda d: d[1])
        return self._better_of(found, self._stepwise((best[0],)))

    def _better_of(self, found: list[Explanation], other: list[Explanation]) -> list[Explanation] | None:
        """Return the other explanation if it fits clearly better, or as well with fewer faults."""
        first, second = (self._consistency([e.hypothesis for e in part]) for part in (found, other))
        if first is None or second is None:
            return None
        needed = self.settings.min_fault_evidence * (1 if len(other) >= len(found) else -1)
        return other if total_misfit(first) - total_misfit(second) > needed else None

    def _stepwise(self, given: tuple[Hypothesis, ...]) -> list[Explanation]:
        """Add the fault with most evidence until none is left; then remove those that others explain."""
        found: list[Hypothesis] = list(given)
        scored: dict[Hypothesis, ScoredFault] = {}
        while len(found) < self.settings.max_faults:
            consistency = self._consistency(found)
            if consistency is None:
                return []
            best = self._best_single(consistency, found)
            if best is None:
                break
            found.append(best.hypothesis)
            scored[best.hypothesis] = best
        return self._explained(_merged(found), scored)

    def _consistency(self, hypotheses: Sequence[Hypothesis]) -> Consistency | None:
        corrections = Corrections()
        for h in hypotheses:
            corrections = corrections.joined(h.corrections())
        spectra = self.transform(corrections)
        return None if spectra is None else Consistency(spectra)

    def _explained(self, found: list[Hypothesis], scored: dict[Hypothesis, ScoredFault]) -> list[Explanation]:
        """Drop every fault without independent evidence; find the alternatives of the others."""
        out: list[Explanation] = []
        if not found:
            return out
        full = self._consistency(found)
        misfit = 0.0 if full is None else total_misfit(full)
        for h in list(found):
            others = [x for x in found if x != h]
            without = self._consistency(others)
            if without is None:
                continue
            evidence = total_misfit(without) - misfit
            if not is_evident(h, evidence, without, self.settings):
                found.remove(h)
                full = self._consistency(found)
                misfit = 0.0 if full is None else total_misfit(full)
                continue
            alternatives = self._alternatives(h, without, evidence)
            out.append(Explanation(h, evidence, scored.get(h, ScoredFault(h, 0.0)).sd, alternatives))
        return out

    def _alternatives(self, h: Hypothesis, without: Consistency, evidence: float) -> tuple[Hypothesis, ...]:
        """List other single faults that explain the data as well as a fault does."""
        scores = score_discrete(without, self.has_units, self.rms)
        if h.kind in CONTINUOUS:
            scores += score_continuous(without, self.has_units, self.settings)
        same = [s.misfit for s in scores if is_same_fault(s.hypothesis, h)]
        # the grid of lags is short where a part of the band is consistent
        at_value = [] if h.kind == "clock" else [float(without.misfits([[h]])[0])]
        reference = min(same + at_value, default=total_misfit(without) - evidence)
        limit = reference + max(self.settings.tied_evidence_share * evidence, self.settings.free_value_penalty)
        tied = [s.hypothesis for s in scores if s.misfit < limit and not is_same_fault(s.hypothesis, h)]
        tied = [x for x in tied if (x.kind, set(x.channels)) != (h.kind, set(h.channels))]
        return tuple(dict.fromkeys(x for x in tied if x.kind == h.kind or x.kind not in ("gain", "delay")))

    def _best_single(self, consistency: Consistency, found: Sequence[Hypothesis]) -> ScoredFault | None:
        """Find the single fault with most evidence beyond those assumed; None if there is none."""
        base = total_misfit(consistency)
        discrete = score_discrete(consistency, self.has_units, self.rms)
        if not is_consistent(consistency, self.settings) and discrete:
            best = min(discrete, key=lambda s: s.misfit)
            evident = is_evident(best.hypothesis, base - best.misfit, consistency, self.settings)
            if evident and is_consistent(consistency, self.settings, [best.hypothesis]):
                return best
        scores = [
            s
            for s in [*discrete, *score_continuous(consistency, self.has_units, self.settings)]
            if is_evident(s.hypothesis, base - s.misfit, consistency, self.settings)
        ]
        scores = [s for s in scores if is_large(s, self.settings)]
        if not scores:
            return None
        best = min(scores, key=lambda s: s.misfit + penalty(s.hypothesis, self.settings))
        if best.hypothesis.kind in ("delay", "offset"):
            return self._lag(consistency, best, scores, found)
        return best

    def _lag(
        self, consistency: Consistency, best: ScoredFault, scores: Sequence[ScoredFault], found: Sequence[Hypothesis]
    ) -> ScoredFault:
        """Choose between delay, offset and drifting clock by the exactly corrected columns."""
        rivals = [
            s
            for s in scores
            if s.hypothesis.kind in ("delay", "offset") and s.hypothesis.channels == best.hypothesis.channels
        ]
        if (drift := drifting_clock(consistency, best.hypothesis, self.settings)) is not None:
            rivals.append(ScoredFault(*drift))
        if len(rivals) == 1:
            return best
        preference = {
            "offset": 0.0,
            "delay": self.settings.free_value_penalty,
            "clock": self.settings.min_fault_evidence,
        }
        exact = [(self._consistency([*found, s.hypothesis]), s) for s in rivals]
        return min(
            (total_misfit(c) + preference[s.hypothesis.kind], i, s) for i, (c, s) in enumerate(exact) if c is not None
        )[2]

    def evidence(self, h: Hypothesis, found: Sequence[Hypothesis]) -> float | None:
        """Log-likelihood that a fault gains in addition to others; None without any relation."""
        others = [x for x in found if not is_same_fault(x, h)]
        without, corrected = self._consistency(others), self._consistency([*others, h])
        return None if without is None or corrected is None else total_misfit(without) - total_misfit(corrected)

    def _better_pair(self, found: list[Explanation]) -> list[Explanation] | None:
        """Explain the data by a pair of signs, units or exchanges where that needs fewer faults or fits better."""
        raw = self._consistency(())
        if raw is None:
            return None
        thin = raw.thinned(PAIR_FREQUENCIES)
        pairs = list(combinations(discrete_hypotheses(candidates(raw.spectra), self.has_units, self.rms), 2))
        pairs = [(a, b) for a, b in pairs if not set(a.channels) & set(b.channels) or "exchanged" in (a.kind, b.kind)]
        best = pairs[int(np.argmin(thin.misfits(pairs)))]
        if set(best) <= {e.hypothesis for e in found}:
            return None
        return self._better_of(found, self._stepwise(best))


def _merged(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Join repeated gains and delays of the same channels; two equal signs cancel."""
    out: list[Hypothesis] = []
    for h in found:
        known = next((x for x in out if x.kind == h.kind and set(x.channels) == set(h.channels)), None)
        if known is None:
            out.append(h)
            continue
        out.remove(known)
        if h.kind in ("unit", "gain"):
            out.append(replace(h, value=known.value * h.value))
        elif h.kind not in ("sign", "exchanged"):
            out.append(replace(h, value=known.value + h.value, delay=known.delay + h.delay))
    return out
