"""A diverging vehicle is reported with its sample and does not affect others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from railui.core import Batch, Vehicles, ZeroPhaseFilter
from tests.kernel.pairs import CHANNELS, Floats, asymmetric_bogie, batch, interval, structure, table, tangent_run
from tests.truth.bogie import Vehicle
from tests.truth.effects import Effect, parse

LOOK = 64  # samples between two looks at divergence
FASTEST = tangent_run(4.0, rate=400.0, speed=100.0)
QUIET = {"c_y": 2e7, "c_x": 4e7, "k_y": 1.5e5, "k_psi": 1.5e5, "lam": (0.02, 0.02)}  # calm at 100 m/s
CALM = [replace(asymmetric_bogie(seed), a=1.28, **QUIET) for seed in range(6)]  # type: ignore[arg-type]
HUNTING = replace(CALM[0], lam=(3.0, 3.0), kappa_x=(2e3, 2e3), kappa_y=(2e3, 2e3))
TOO_STIFF = replace(CALM[0], c_y=3e9, c_x=8e9)  # steps many times too long: overflows long before the next look
LOST = pytest.mark.parametrize("lost", [HUNTING, TOO_STIFF], ids=["hunting", "steps too long"])
WITH = pytest.mark.parametrize(
    "effects",
    [
        [],
        [parse("maxwell_damper at=secondary_lateral stiffness=4e5 damping=1e4 blow_off=3000")],
        [parse("hysteresis at=secondary_lateral stiffness=4e5 yield=800")],
        [parse("rail_flexibility at=track stiffness=2e7 damping=1e5")],
    ],
    ids=["plain", "damper", "hysteresis", "rail"],
)


def together(
    vehicles: Sequence[Vehicle], effects: Sequence[Effect], filter: ZeroPhaseFilter | None = None
) -> tuple[Floats, list[int]]:
    made = structure(vehicles[0], effects)
    some = batch(vehicles, [effects] * len(vehicles))
    found, lost = made.simulate(some, table(FASTEST, 1.28, 2), interval(FASTEST), 2, CHANNELS, filter=filter)
    return found, lost.tolist()


@WITH
@LOST
def test_a_diverging_vehicle_is_reported_and_does_not_change_its_neighbours(
    lost: Vehicle, effects: Sequence[Effect]
) -> None:
    found, where = together([CALM[0], lost, *CALM[1:]], effects)
    alone, fine = together(CALM, effects)
    assert where[1] > 0 and fine == [-1] * len(CALM)
    assert where[:1] + where[2:] == fine
    assert np.array_equal(np.delete(found, 1, axis=0), alone)


@WITH
@LOST
def test_there_is_no_nan_in_the_output(lost: Vehicle, effects: Sequence[Effect]) -> None:
    found, where = together([CALM[1], lost], effects)
    assert where[1] > 0
    assert np.isfinite(found).all()


@LOST
def test_there_is_no_nan_behind_a_filter(lost: Vehicle) -> None:
    sos = signal.butter(2, [0.4, 20.0], "bandpass", fs=400.0, output="sos")
    band = ZeroPhaseFilter(sos, signal.sosfilt_zi(sos), 200, 50, np.ones(len(CHANNELS)))
    found, where = together([CALM[1], lost], [], band)
    assert where[1] > 0
    assert np.isfinite(found).all()
    assert np.array_equal(found[0], together(CALM[1:2], [], band)[0][0])


def test_the_sample_reported_is_where_the_vehicle_had_left_the_rails() -> None:
    found, where = together([HUNTING], [])
    off = (np.abs(found[0, [0, 1, 8, 9]]) > 0.1).any(axis=0)  # 0.1 m, 0.1 rad
    first = int(np.argmax(off))
    assert first <= where[0] <= first + LOOK
    assert np.abs(found[0, 8:, where[0] :]).max() == 0.0  # put to rest


def test_ride_statistics_report_divergence_without_affecting_neighbours() -> None:
    made, drive = structure(CALM[0]), (table(FASTEST, 1.28, 2), interval(FASTEST), 2, CHANNELS[:2])
    rides = made.ride_statistics(batch([CALM[1], TOO_STIFF]), *drive, np.full(2, 7e-3))
    alone = made.ride_statistics(batch([CALM[1]]), *drive, np.full(1, 7e-3))
    assert rides.diverged[0] == -1 and rides.diverged[1] > 0
    assert np.array_equal(rides.displacement[0], alone.displacement[0])


def test_the_divergence_limit_of_a_rig_does_not_depend_on_its_units() -> None:
    t = np.arange(2001) / 100.0
    rows = np.zeros((4001, 5))
    rows[:, 2] = 1e6
    rigs = Batch.from_arrays(
        np.array([[1.0, 1.0, 0.0, 1.0, 0.0], [1.0, -400.0, 0.0, 1.0, 0.0]])
    )  # m, k, c, gain, preload
    found, lost = Vehicles("rig").simulate(rigs, rows, 0.01, 1, ["z"])
    assert lost[0] == -1 and lost[1] > 0
    assert np.abs(found[0, 0] - 1e6 * (1.0 - np.cos(t))).max() < 1.0
    assert np.isfinite(found).all()
