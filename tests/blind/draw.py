"""Random cases of the trial; campaigns of a group share a planted structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tests.blind.cases import (
    EFFECTS_NOT_IN_LIBRARY,
    SENSOR_SETS,
    STRONG,
    WEAK,
    PlantedCase,
    library_entries,
    planted_effect,
)
from tests.truth.campaign import Order
from tests.truth.effects import Effect, check_together

GROUP = 2  # campaigns of one planted structure
# groups in a trial of 150 loops; those for detection limits run one loop without an effect and LIMITS with one each
GROUPS = {"limit": 10, "nothing": 7, "catalogue": 18, "two": 6, "three": 4, "outside": 10}
LIMITS = 2
LOOPS = GROUP * (sum(GROUPS.values()) + LIMITS * GROUPS["limit"])
# letters that priors hold are drawn as wide as their priors: a standard deviation of a fifth of the nominal value
PRIOR_SPREAD = {"delta": 0.42, "kappa_s": 0.35}
# share of the campaigns by what their file says about noise
NOISE: tuple[tuple[float, dict[str, Any]], ...] = (
    (0.45, {}),
    (0.15, {"stated": 0.0}),
    (0.15, {"stated": 1.0 / 3.0}),
    (0.15, {"pink": True}),
    (0.10, {"unmeasured": 100.0}),
)


def draw_trial(loops: int, seed: int, seconds: Sequence[float]) -> list[PlantedCase]:
    """Draw cases, their groups in random order, for about so many loops."""
    rng = np.random.default_rng([seed, 47])
    counts = {sort: max(round(n * loops / LOOPS), 1 if loops >= LOOPS // 4 else 0) for sort, n in GROUPS.items()}
    if not any(counts.values()):
        counts["limit"] = 1
    sorts = [sort for sort, n in counts.items() for _ in range(n)]
    groups = [_group(rng, sorts[i], seed + GROUP * k, seconds) for k, i in enumerate(rng.permutation(len(sorts)))]
    return [case for group in groups for case in group]


def _group(rng: np.random.Generator, sort: str, seed: int, seconds: Sequence[float]) -> tuple[PlantedCase, ...]:
    """Draw a group: kinds and locations in common; vehicle, track, size, sensors and noise of each its own."""
    entries = _entries(rng, {"catalogue": 1, "two": 2, "three": 3}.get(sort, 0))
    outside = EFFECTS_NOT_IN_LIBRARY[int(rng.integers(len(EFFECTS_NOT_IN_LIBRARY)))]
    cases = []
    for k in range(GROUP):
        size = float(rng.uniform(WEAK, STRONG)) if sort == "catalogue" else STRONG
        effects: tuple[Effect, ...] = (outside,) if sort == "outside" else ()
        effects = effects or tuple(planted_effect(entry, size) for entry in entries)
        needed = {e.at for e in effects if e.kind.startswith("sensor")}
        sets = [out for out in SENSOR_SETS.values() if not needed & set(out)]
        shares = np.array([share for share, _ in NOISE])
        options = NOISE[int(rng.choice(len(NOISE), p=shares / shares.sum()))][1]
        if sort == "limit":
            options = {name: x for name, x in options.items() if name != "unmeasured"}
        order = Order(
            effects=effects,
            seed=seed + k,
            name=f"trial {seed + k}",
            seconds=tuple(seconds),
            without=sets[int(rng.integers(len(sets)))],
            spread=PRIOR_SPREAD,
        )
        cases.append(PlantedCase(sort, effects, replace(order, **options)))
    return tuple(cases)


def _entries(rng: np.random.Generator, count: int) -> list[tuple[str, str, int | None]]:
    """Draw entries of the library, of different kinds at different locations."""
    library = library_entries()
    while True:
        found = [library[int(k)] for k in rng.choice(len(library), count, replace=False)]
        if len({kind for kind, _, _ in found}) == count == len({at for _, at, _ in found}):
            check_together([planted_effect(entry, STRONG) for entry in found])
            return found
