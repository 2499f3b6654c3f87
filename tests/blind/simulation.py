"""Simulated campaigns of a trial, many side by side, kept in files so that a trial can be repeated."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from tests.blind.cases import PlantedCase
from tests.truth.campaign import Campaign, steps_of, try_campaigns

Case = TypeVar("Case")
GROUP = 24  # campaigns simulated side by side


def simulation_groups(cases: Sequence[PlantedCase], store: Path) -> list[list[PlantedCase]]:
    """Group the cases that the store lacks by their time step, the quickest first."""
    lacking = [case for case in cases if not path_of(case, store).exists()]
    steps = [(steps_of(case.order) - 1).bit_length() for case in lacking]
    return grouped(lacking, steps, GROUP)


def grouped(cases: Sequence[Case], steps: Sequence[int], size: int) -> list[list[Case]]:
    """Group cases of the same number of steps, at most so many together, those with fewest steps first."""
    alike = [[case for case, n in zip(cases, steps, strict=True) if n == some] for some in sorted(set(steps))]
    return [some[i : i + size] for some in alike for i in range(0, len(some), size)]


def simulate(cases: Sequence[PlantedCase], store: Path) -> None:
    """Simulate campaigns side by side and store them; None for one whose drawn vehicles all derail."""
    store.mkdir(parents=True, exist_ok=True)
    found = try_campaigns([case.order for case in cases], round_steps=True)
    for case, campaign in zip(cases, found, strict=True):
        path_of(case, store).write_bytes(pickle.dumps(campaign))


def stored_campaign(case: PlantedCase, store: Path) -> Campaign | None:
    """Read the campaign of a case from the store."""
    campaign: Campaign | None = pickle.loads(path_of(case, store).read_bytes())
    return campaign


def path_of(case: PlantedCase, store: Path) -> Path:
    """File of a campaign: by its number, and all that it depends on."""
    return store / f"{case.order.seed}_{hashlib.sha256(repr(case.order).encode()).hexdigest()[:16]}.pickle"
