"""Faults of single runs joined to faults of the campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from railui.campaign.corrections.correction import yaml_line
from railui.campaign.faults.families import CONTINUOUS
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.hypotheses import Hypothesis
from railui.campaign.faults.search import Explanation, FaultSearch
from railui.campaign.faults.wording import UNITS, fault_text
from railui.campaign.settings.faults import FaultSettings

PREFERENCE = ("sign", "unit", "exchanged", "offset", "gravity", "delay", "gain", "clock")
Key = tuple[str, frozenset[str], float]


@dataclass
class _Group:
    """Explanations of several runs that can be one fault: hypothesis of every key by run, and their evidence."""

    members: dict[Key, dict[str, Hypothesis]] = field(default_factory=dict)
    evidence: dict[str, float] = field(default_factory=dict)
    sd: dict[Key, dict[str, float]] = field(default_factory=dict)

    def add(self, run: str, e: Explanation) -> None:
        """Add an explanation of a run."""
        self.evidence[run] = e.evidence
        self.sd.setdefault(_key(e.hypothesis), {})[run] = e.sd
        for h in (e.hypothesis, *e.alternatives):
            self.members.setdefault(_key(h), {})[run] = h

    def keys(self, settings: FaultSettings) -> list[Key]:
        """List the keys that explain most runs with one value, preferred kinds first."""
        most = max(len(runs) for runs in self.members.values())
        keys = [k for k, runs in self.members.items() if len(runs) == most]
        uniform = [k for k in keys if _is_uniform(list(self.members[k].values()), settings)]
        return sorted(uniform or keys, key=lambda k: PREFERENCE.index(k[0]))


def merged_faults(
    explanations: Mapping[str, Sequence[Explanation]],
    searches: Mapping[str, FaultSearch],
    settings: FaultSettings,
) -> list[Fault]:
    """Join the faults of all runs.

    Parameters
    ----------
    explanations
        Faults by run.
    searches
        Their searches by run, which show whether a run without the fault contradicts it.
    """
    groups: list[_Group] = []
    clocks = [e.hypothesis for found in explanations.values() for e in found if e.hypothesis.kind == "clock"]
    for run, found in explanations.items():
        for e in (_with_clock(e, clocks) for e in found):
            keys = {_key(h) for h in (e.hypothesis, *e.alternatives)}
            group = next((g for g in groups if keys & set(g.members) and run not in g.evidence), None)
            if group is None:
                groups.append(group := _Group())
            group.add(run, e)
    return [fault for group in groups for fault in _faults(group, explanations, searches, settings)]


def _with_clock(e: Explanation, clocks: Sequence[Hypothesis]) -> Explanation:
    """Return the drifting clock of another run in place of a delay of the same channels, in a run too short for it."""
    h = e.hypothesis
    clock = next((c for c in clocks if h.kind == "delay" and set(c.channels) == set(h.channels)), None)
    return e if clock is None else replace(e, hypothesis=clock, sd=float("nan"), alternatives=())


def _faults(
    group: _Group,
    explanations: Mapping[str, Sequence[Explanation]],
    searches: Mapping[str, FaultSearch],
    settings: FaultSettings,
) -> list[Fault]:
    keys = group.keys(settings)
    runs = group.members[keys[0]]
    if not _is_uniform(list(runs.values()), settings):
        return [
            hypothesis_fault(h, (run,), len(searches) > 1, (), _sd(group, keys[0], (run,)), settings)
            for run, h in runs.items()
        ]
    h = _mean(runs, group.evidence)
    files = tuple(r for r in searches if r in runs or _agrees(h, searches[r], explanations[r]))
    restricted = len(files) < len(searches)
    tied = [_mean(group.members[k], group.evidence) for k in keys[1:] if not _is_preferred(keys[0], k)]
    names = files if restricted else ()
    alternatives = tuple(yaml_line(x.corrections(names)) for x in tied)
    return [hypothesis_fault(h, files, restricted, alternatives, _sd(group, keys[0], tuple(runs)), settings)]


def _agrees(h: Hypothesis, search: FaultSearch, found: Sequence[Explanation]) -> bool:
    """True if a run is as consistent with the fault as without, or more so."""
    evidence = search.evidence(h, [e.hypothesis for e in found])
    return evidence is None or evidence > 0.0


def hypothesis_fault(
    h: Hypothesis,
    files: tuple[str, ...],
    restricted: bool,
    alternatives: tuple[str, ...],
    sd: float | None,
    settings: FaultSettings,
) -> Fault:
    """Return a hypothesis as a fault of some runs; restricted: of these alone."""
    kind = "track_offset" if h.kind == "offset" else h.kind
    value = {"sign": -1.0, "exchanged": None, "clock": 1.0 + h.value}.get(h.kind, h.value)
    corrections = h.corrections(files if restricted else ())
    channels = ("track",) if h.kind == "offset" else h.channels
    unit = UNITS.get(h.kind, "1")
    return Fault(
        kind, channels, value, sd, unit, files, fault_text(h), is_serious(h, settings), corrections, alternatives
    )


def is_serious(h: Hypothesis, settings: FaultSettings) -> bool:
    """True for a fault that no effect of a sensor describes."""
    if h.kind == "gain":
        return not 1.0 / settings.serious_gain <= h.value <= settings.serious_gain
    if h.kind == "delay":
        limit = settings.serious_delay if len(h.channels) == 1 else settings.serious_group_delay
        return abs(h.value) > limit
    return True


def _key(h: Hypothesis) -> Key:
    return h.kind, frozenset(h.channels), float(f"{h.value:.4g}") if h.kind == "unit" else 0.0


def _is_uniform(hypotheses: Sequence[Hypothesis], settings: FaultSettings) -> bool:
    """True if a value is the same in all runs."""
    kind, values = hypotheses[0].kind, [h.value for h in hypotheses]
    if kind not in CONTINUOUS:
        return True
    spread: float = getattr(settings, f"{kind}_spread")
    relative = abs(float(np.mean(values))) if kind in ("gain", "offset", "delay") else 0.0
    return bool(np.ptp(values) <= max(spread, settings.relative_spread * relative))


def _is_preferred(key: Key, other: Key) -> bool:
    """True if one explanation is the more natural one of the same fault: a track that is recorded elsewhere."""
    return key[0] == "offset" and other[0] in ("delay", "clock") and other[1] == key[1]


def _mean(runs: Mapping[str, Hypothesis], evidence: Mapping[str, float]) -> Hypothesis:
    """Mean of a value over the runs, weighted by their evidence."""
    first = next(iter(runs.values()))
    if first.kind not in CONTINUOUS:
        return first
    weights = [max(evidence[r], 1e-9) for r in runs]
    value = float(np.average([h.value for h in runs.values()], weights=weights))
    delay = float(np.average([h.delay for h in runs.values()], weights=weights))
    return replace(first, value=value, delay=delay)


def _sd(group: _Group, key: Key, runs: Sequence[str]) -> float | None:
    """Standard deviation of the weighted mean; None where none is known."""
    known = [x for r in runs if (x := group.sd.get(key, {}).get(r)) is not None and np.isfinite(x)]
    return float(1.0 / np.sqrt(np.sum(1.0 / np.square(known)))) if known else None
