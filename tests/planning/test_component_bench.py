"""A component on a bench: its motion and force by hand, and the decision on measured forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.campaign.segment import Segment
from railui.identification.structure.candidates import Candidate
from railui.planning.component_bench import (
    FORCE_NOISE,
    PlannedBench,
    component,
    decide_bench,
    planned_benches,
    predict_force,
    simulate_bench,
)
from railui.planning.next_run import next_runs
from railui.planning.rivals import RivalModel
from railui.vehicle.effects import PlacedEffect
from tests.planning.test_next_run import RUNS, context, rivals
from tests.truth.bogie import Vehicle
from tests.truth.component import component_force
from tests.truth.effects import effect
from tests.truth.files import vehicle_of

BENCH = PlannedBench("secondary_lateral", 0, 0.01)


def friction(force: float) -> RivalModel:
    effect = PlacedEffect("dry_friction", "secondary_lateral", None, {"force": force, "slip_speed": 1e-3})
    first = rivals(1.0)[0]
    return replace(first, candidate=Candidate("dry_friction", effect.at, None), model=first.model.with_effect(effect))


def test_the_force_of_a_spring_and_a_damper_is_that_by_hand() -> None:
    (plain, spring), z, dt = rivals(6e5), BENCH.motion(), 0.005
    force = predict_force(context(), spring, BENCH, z, dt, 1.0).series[0]
    without = predict_force(context(), plain, BENCH, z, dt, 1.0).series[0]
    k, c = plain.model.local_elements[("secondary_lateral", 0)]
    # F = k z + c z', the mean left out; the first sines, away from the steps of the speed between two frequencies
    first = slice(20, 700)
    t = dt * np.arange(len(z))[first]
    by_hand = k * z[first] + c * 0.01 * np.pi * np.cos(np.pi * t)
    assert without[first] - without[first].mean() == pytest.approx(by_hand - by_hand.mean(), abs=2e-3 * by_hand.max())
    assert force - without == pytest.approx(6e5 * (z - z.mean()), abs=1.0)


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        ("dry_friction", {"force": 2000.0, "slip_speed": 1e-3}),
        ("hysteresis", {"stiffness": 2e6, "yield": 3000.0}),
        ("maxwell_damper", {"stiffness": 2e6, "damping": 1e5}),
        ("free_play", {"half_width": 2e-3}),
    ],
)
def test_forces_of_a_component_agree_with_the_independent_generator(kind: str, parameters: dict[str, float]) -> None:
    placed = PlacedEffect(kind, "secondary_lateral", None, parameters)
    model = context().nominal.with_effect(placed)
    z = BENCH.motion()
    rival = RivalModel(None, model, ("vehicle.primary.lateral_stiffness",), np.zeros((1, 1)))
    force = predict_force(context(), rival, BENCH, z, 0.005, 1.0).series[0]
    vehicle = vehicle_of(model.design.values, Vehicle())
    other = component_force(
        vehicle, [effect(kind, "secondary_lateral", **parameters)], "secondary_lateral", 0, 0.005 * np.arange(len(z)), z
    )
    assert force == pytest.approx(other - other.mean(), abs=2e-3 * np.abs(other).max())


def test_only_components_at_which_an_undecided_effect_acts_are_proposed() -> None:
    (bench,) = planned_benches(context(), rivals(6e5))
    assert (bench.at, bench.port) == ("secondary_lateral", 0) and 1e-3 < bench.amplitude < 0.05
    assert planned_benches(context(), rivals(6e5)[:1]) == []


def test_a_bench_separates_laws_and_is_ranked_among_the_runs() -> None:
    found = next_runs(context(), [*rivals(6e5), friction(2000.0)], RUNS[:1], ("ayf",), (), [BENCH])
    assert len(found) == 2 and {r.sensors for r in found} == {("ayf",), ("F",)}
    bench = next(r for r in found if r.sensors == ("F",))
    assert bench.probability > 0.95


def test_a_force_below_the_noise_of_the_load_cell_is_not_separated() -> None:
    (found,) = next_runs(context(), rivals(30.0), [], ("ayf",), (), [BENCH])
    assert found.probability < 0.3


@pytest.mark.parametrize(("true", "sign"), [(0, 1), (1, -1)])
def test_measured_forces_decide_for_the_component_that_made_them(true: int, sign: int) -> None:
    models = rivals(6e5)
    z = BENCH.motion()
    force = predict_force(context(), models[true], BENCH, z, 0.005, 1.0).series[0] + 300.0  # and a preload
    force += FORCE_NOISE * force.std() * np.random.default_rng(3).standard_normal(len(z))
    segment = Segment("bench.csv", "test", 0, {"t": 0.005 * np.arange(len(z)), "z": z, "F": force}, 0.005, "bench")
    (decision,) = decide_bench(context(), models, BENCH, [segment])
    assert decision.is_clear and np.sign(decision.z) == sign
    still = replace(segment, columns={**segment.columns, "F": np.ones(len(z))})
    with pytest.raises(ValueError, match="does not change"):
        decide_bench(context(), models, BENCH, [still])


def test_a_component_is_named_by_its_location_and_number() -> None:
    model = context().nominal
    assert (component(model, "primary_lateral.2").port, component(model, "primary_lateral").port) == (2, 1)
    with pytest.raises(ValueError, match=r"no component at primary_lateral\.3: components are at primary_lateral"):
        component(model, "primary_lateral.3")


def test_a_bench_has_realisations_of_every_rival() -> None:
    found = simulate_bench(context(), rivals(6e5), BENCH)
    assert found is not None and found.predicted.channels == ("F",) and len(found.measured) == 2
    assert np.all(np.isfinite(found.measured))
