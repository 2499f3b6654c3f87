"""Identical digits on any number of threads, in any lane, with any neighbours, and at amount 0."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from railui import core
from railui.core import Batch, Placement, Vehicles
from railui.vehicle.effect_reader import ABSCISSAE
from railui.vehicle.effects import has_abscissa
from tests.kernel.pairs import (
    CHANNELS,
    ROUNDING,
    Floats,
    assert_same,
    asymmetric_bogie,
    batch,
    effect_locations,
    interval,
    kernel,
    structure,
    table,
    tangent_run,
)
from tests.kernel.test_effects import strong_effect
from tests.truth.bogie import Vehicle
from tests.truth.effects import KINDS, Effect, effect, parse
from tests.truth.road import Table

RUN = tangent_run(1.0)
EFFECTS = [
    parse("creep_saturation at=contact friction=0.05"),
    parse("flange_contact at=contact clearance=0.002 stiffness=14.6e6"),
    parse("rail_flexibility at=track wheelset=2 stiffness=2e7 damping=1e5"),
    parse("hysteresis at=secondary_lateral stiffness=4e5 yield=800"),
    parse("dry_friction at=primary_yaw force=1500 slip_speed=0.006"),
    parse("run_out at=wheelset force=1500 rolling_radius=0.46 phase=0.2"),
]
COUNT = 33


@cache
def many(with_effects: bool) -> tuple[Vehicles, Batch]:
    """Thirty-three different bogies of one structure."""
    effects = EFFECTS if with_effects else []
    vehicles = [replace(asymmetric_bogie(seed), a=1.28) for seed in range(COUNT)]
    return structure(vehicles[0], effects), batch(vehicles, [effects] * COUNT)


def series(made: Vehicles, some: Batch, jobs: int = 1) -> Floats:
    return made.simulate(some, table(RUN, 1.28, 2), interval(RUN), 2, CHANNELS, jobs=jobs)[0]


@cache
def alone(with_effects: bool) -> Floats:
    """Each of them simulated by itself, [vehicle, channel, sample]."""
    made, all_of_them = many(with_effects)
    return np.concatenate([series(made, all_of_them.select([k])) for k in range(COUNT)])


@pytest.mark.parametrize("with_effects", [False, True], ids=["plain", "effects"])
@pytest.mark.parametrize("count", [1, 2, 15, 16, 17, 33])
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_vehicle_has_the_same_digits_alone_and_in_a_batch_of_any_size(
    with_effects: bool, count: int, jobs: int
) -> None:
    made, all_of_them = many(with_effects)
    found = series(made, all_of_them.select(slice(0, count)), jobs)
    assert np.array_equal(found, alone(with_effects)[:count])


@pytest.mark.parametrize("with_effects", [False, True], ids=["plain", "effects"])
def test_a_vehicle_has_the_same_digits_in_every_lane(with_effects: bool) -> None:
    made, all_of_them = many(with_effects)
    order = np.random.default_rng(0).permutation(COUNT)
    assert np.array_equal(series(made, all_of_them.select(order), 2), alone(with_effects)[order])


def between(k: int, neighbours: Batch) -> Floats:
    """Vehicle k of the thirty-three between two neighbours."""
    made, all_of_them = many(True)
    rows = [neighbours.select([0]), all_of_them.select([k]), neighbours.select([1])]
    names = ("numbers", "effects", "amounts")
    batch_of_three = Batch.from_arrays(*(np.concatenate([getattr(one, name) for one in rows]) for name in names))
    return np.asarray(series(made, batch_of_three)[1])


def test_sliding_neighbours_do_not_change_a_vehicle() -> None:
    sliding = [parse("creep_saturation at=contact friction=0.01"), *EFFECTS[1:]]
    neighbours = batch([replace(asymmetric_bogie(k), a=1.28) for k in (50, 51)], [sliding] * 2)
    assert np.array_equal(between(4, neighbours), alone(True)[4])


@pytest.mark.parametrize("amount", [0.0, 0.05, 0.7])
def test_neighbours_with_other_amounts_do_not_change_a_vehicle(amount: float) -> None:
    neighbours = batch([replace(asymmetric_bogie(k), a=1.28) for k in (50, 51)], [EFFECTS] * 2, amount)
    assert np.array_equal(between(7, neighbours), alone(True)[7])


# ----------------------------------------------------------------------------------------------------- amounts

OTHERS = [parse("spring at=primary_lateral stiffness=1e6"), parse("creep_saturation at=contact friction=0.2")]


def sensors() -> list[Effect]:
    numbers = {"sensor_delay": {"delay": 0.01}, "sensor_gain": {"gain": 1.3}, "sensor_offset": {"offset": 0.2}}
    return [
        Effect(r["kind"], "ayf", None, numbers[r["kind"]]) for r in core.effect_catalogue() if r["acts"] == "sensor"
    ]


EVERYWHERE = [*(effect(k, at, w, **strong_effect(k, at)) for k, at, w in effect_locations()), *sensors()]


@pytest.mark.parametrize("one", EVERYWHERE, ids=lambda e: f"{e.kind}-{e.at}-{e.wheelset}")
def test_amount_zero_is_the_vehicle_without_the_effect_to_the_last_digit(one: Effect) -> None:
    vehicle, run = asymmetric_bogie(20), tangent_run(0.5)
    # a wheelset has one law of creep
    others = [o for o in OTHERS if not {"creep forces"} & {KINDS[o.kind].supersedes} & {KINDS[one.kind].supersedes}]
    ones = [1.0] * len(others)
    found = with_amounts(vehicle, [*others, one], run, [*ones, 0.0])
    without = with_amounts(vehicle, others, run, ones)
    if one.kind == "coach_mode":  # one body more, so another order of sums
        assert np.abs(found - without).max() <= ROUNDING * np.abs(without).max()
    else:
        assert np.array_equal(found, without)
    assert not np.array_equal(with_amounts(vehicle, [*others, one], run, [*ones, 1.0]), without)


def with_amounts(vehicle: Vehicle, effects: Sequence[Effect], run: Table, amounts: Sequence[float]) -> Floats:
    one = replace(batch([vehicle], [list(effects)]), amounts=np.array([amounts]))
    found, _ = structure(vehicle, effects).simulate(one, table(run, vehicle.a, 1), interval(run), 1, CHANNELS)
    return np.asarray(found[0])


@pytest.mark.parametrize("one", EVERYWHERE, ids=lambda e: f"{e.kind}-{e.at}-{e.wheelset}")
def test_amount_zero_of_the_only_effect_is_the_plain_bogie(one: Effect) -> None:
    # the plain bogie may be summed in another order
    vehicle, run = asymmetric_bogie(21), tangent_run(0.5)
    assert_same(kernel(vehicle, run, [one], amount=0.0), kernel(vehicle, run), ROUNDING)


@pytest.mark.parametrize("one", EVERYWHERE, ids=lambda e: f"{e.kind}-{e.at}-{e.wheelset}")
def test_a_small_amount_moves_the_vehicle_in_proportion(one: Effect) -> None:
    vehicle, run = asymmetric_bogie(22), tangent_run(0.5)
    plain = with_amounts(vehicle, [one], run, [0.0])
    tiny, twice = (with_amounts(vehicle, [one], run, [a]) - plain for a in (1e-4, 2e-4))
    moved = np.abs(tiny).max(axis=1)
    assert moved.max() > 0.0
    assert np.abs(twice - 2.0 * tiny).max(axis=1)[moved > 1e-12].max() < 0.05 * moved.max()


# ------------------------------------------------------------------------------------------- every law, lane by lane


def choices(kind: str) -> Sequence[str | None]:
    """Coordinates against which the curve of a kind may be defined; None alone where there is no choice."""
    return ABSCISSAE if has_abscissa(core.effect_record(kind)) else (None,)


def chosen(one: Effect) -> list[Effect]:
    """An effect once for every choice that it leaves."""
    return [one if x is None else replace(one, parameters={**one.parameters, "against": x}) for x in choices(one.kind)]


def scaled(one: Effect, factor: float) -> Effect:
    """The same law with other numbers."""
    numbers = {
        key: x if isinstance(x, str) else [factor * y for y in x] if isinstance(x, list) else factor * x
        for key, x in one.parameters.items()
    }
    return replace(one, parameters=numbers)


@pytest.mark.parametrize(
    "one",
    [each for one in EVERYWHERE for each in chosen(one)],
    ids=lambda e: f"{e.kind}-{e.at}-{e.wheelset}-{e.parameters.get('against', '')}",
)
def test_lanes_with_other_numbers_and_amounts_of_a_law_behave_as_alone(one: Effect) -> None:
    run, factors = tangent_run(0.5), (1.0, 0.8, 0.65, 0.9)
    vehicles = [replace(asymmetric_bogie(seed), a=1.28) for seed in range(60, 64)]
    # no 0: a bogie on which nothing acts in any lane is the plain one, which may be summed in another order
    amounts = np.array([[1.0], [0.4], [0.05], [1.0]])
    some = replace(batch(vehicles, [[scaled(one, f)] for f in factors]), amounts=amounts)
    made, drive = structure(vehicles[0], [one]), (table(run, 1.28, 1), interval(run), 1, CHANNELS)
    together, _ = made.simulate(some, *drive)
    for k in range(len(factors)):
        assert np.array_equal(made.simulate(some.select([k]), *drive)[0][0], together[k]), amounts[k]


def test_a_choice_is_no_number_of_a_row() -> None:
    z, v, s = (Placement("measured_force", "frame", None, 5, x) for x in ABSCISSAE)
    assert len({z, v, s}) == 3
    assert Placement("measured_force", "frame", None, 5) == z
    assert [p for p in core.parameter_paths("rig") if "input" in p] == []


# ---------------------------------------------------------------------------------------------------- SIMD levels

PORTABLE = """
import json, sys
from railui import core
from tests.kernel import test_lanes as here
made, some = here.many(True)
print(json.dumps([core.simd_level(), here.series(made, some.select([0, 1])).tolist()]))
"""


def test_without_vector_instructions_the_kernel_agrees_to_1e_9() -> None:
    environment = {**os.environ, "RAILUI_SIMD": "portable"}
    done = subprocess.run([sys.executable, "-c", PORTABLE], capture_output=True, text=True, env=environment, check=True)
    level, found = json.loads(done.stdout)
    assert level == "portable"
    here = alone(True)[:2]
    apart = np.abs(np.array(found) - here).max(axis=2) / here.std(axis=2)
    assert apart.max() < 1e-9
