"""Monitor of a fleet on drawn quantities: levels that wander in all vehicles, and one that runs away."""

from __future__ import annotations

import numpy as np
import pytest

from railui.campaign.settings.fleet import FleetSettings
from railui.fleet import level_wander
from railui.fleet.history import Monitor
from railui.fleet.monitor import monitor_fleet
from railui.fleet.observations import ERROR, Observations, Quantity

VEHICLES, BLOCKS, SD = 20, 60, 0.1
WANDERING, STEADY = 0, 1  # quantities


def drawn(seed: int, wander: float, ramp: float = 0.0) -> Observations:
    """A run per vehicle and week; levels of the first quantity wander, vehicle 3 drifts from block 30 on."""
    rng = np.random.default_rng(seed)
    walk = np.cumsum(wander * rng.standard_normal((BLOCKS, VEHICLES)), axis=0)
    values = np.stack([walk, np.zeros_like(walk)], axis=2) + 0.2 * rng.standard_normal((VEHICLES, 2))
    values += SD * rng.standard_normal(values.shape)
    values[30:, 3, STEADY] += ramp * np.arange(BLOCKS - 30)
    n = BLOCKS * VEHICLES
    block, vehicle = np.divmod(np.arange(n), VEHICLES)
    return Observations(
        vehicles=tuple(f"v{k}" for k in range(VEHICLES)),
        sections=("north",),
        quantities=(Quantity("error at ay1", ERROR), Quantity("error at ay2", ERROR)),
        files=tuple(f"{k}.csv" for k in range(n)),
        summaries=(),
        vehicle=vehicle,
        section=np.zeros(n, dtype=np.int64),
        time=20000.0 + 7.0 * block,
        covariates=np.zeros((n, 2)),
        use=np.repeat((block / 52.0)[:, None], 2, axis=1),
        unit=np.repeat(vehicle[:, None], 2, axis=1),
        y=values.reshape(n, 2),
        sd=np.full((n, 2), SD),
    )


def monitored(data: Observations) -> Monitor:
    return monitor_fleet(data, FleetSettings(block_days=7.0))


def correlation(found: Monitor, quantity: int) -> float:
    """Correlation of the scores of successive blocks in the second half."""
    score = found.score[30:, :, quantity]
    return float(np.nanmean(score[1:] * score[:-1]) / np.nanvar(score))


def test_scores_of_levels_that_wander_are_independent(monkeypatch: pytest.MonkeyPatch) -> None:
    data = drawn(seed=5, wander=0.5 * SD)
    found = monitored(data)
    assert abs(correlation(found, WANDERING)) < 0.15
    assert abs(correlation(found, STEADY)) < 0.1
    monkeypatch.setattr(level_wander, "WANDERS", (0.0,))
    constant = monitored(data)
    assert correlation(constant, WANDERING) > 0.3
    assert len(found.alarms) < 0.7 * len(constant.alarms)


def test_a_drift_of_one_vehicle_is_found_where_levels_wander() -> None:
    alarms = monitored(drawn(seed=6, wander=0.5 * SD, ramp=0.5 * SD)).alarms
    found = [alarm for alarm in alarms if alarm.subject == 3 and alarm.block >= 30]
    assert found
    assert found[0].quantities[0] == STEADY
    assert found[0].block < 45
