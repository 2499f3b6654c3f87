"""Simulated campaigns of a group of cases, kept in files: a trial can be repeated without simulating them again."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from pathlib import Path

from tests.blind.cases import PlantedCase
from tests.truth.campaign import Campaign, campaign, campaigns

Campaigns = list[Campaign | None]


def simulate_cases(cases: Sequence[PlantedCase], store: Path | None = None) -> Campaigns:
    """Simulate the campaigns of a group, or read them from the store; None: every drawn vehicle derails."""
    if store is None:
        return _simulate(cases)
    orders = [case.order for case in cases]
    path = store / f"{cases[0].order.name} {cases[0].text}.pickle".replace(" ", "_").replace("/", "_")
    if path.exists():
        stored_orders, found = pickle.loads(path.read_bytes())
        if stored_orders == orders:
            return list(found)
    found = _simulate(cases)
    store.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps((orders, found)))
    return found


def _simulate(cases: Sequence[PlantedCase]) -> Campaigns:
    """Simulate campaigns together, or each alone where one cannot be simulated."""
    try:
        return list(campaigns([case.order for case in cases]))
    except (ArithmeticError, ValueError):
        return [_simulate_alone(case) for case in cases]


def _simulate_alone(case: PlantedCase) -> Campaign | None:
    try:
        return campaign(case.order)
    except (ArithmeticError, ValueError):
        return None
