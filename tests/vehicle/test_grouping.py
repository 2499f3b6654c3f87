"""Designs in one batch behave as alone, for every effect of the catalogue."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui import core
from railui.curving import curve, curve_many
from railui.ride_quality.evaluation import excitation_of, ride_many, simulate_rides
from railui.running_stability.critical_speed import linear_stability_many
from railui.vehicle.design_reader import Design, PlacedEffect, load_design
from railui.vehicle.effect_reader import ABSCISSAE
from railui.vehicle.effects import has_abscissa
from railui.vehicle.grouping import group_by_structure
from railui.vehicle.model import Model
from tests.kernel.pairs import effect_locations
from tests.kernel.test_effects import strong_effect

HOME = Path(__file__).parents[2]
BOGIE = load_design(HOME / "designs/test_bogie.yaml")
TRACK = "erri_b176_low length=100 seed=1"
KINDS = [r["kind"] for r in core.effect_catalogue() if r["acts"] != "sensor"]
SHARES = (1.0, 0.99)  # of the numbers of a law; a radius of the run-out stays near that of the wheel


def placed(kind: str, share: float) -> Iterator[PlacedEffect]:
    """A law at all its places of a bogie, at both wheelsets and at each, with every choice that it leaves."""
    for _, at, wheelset in effect_locations([kind]):
        words = {
            key: tuple(share * y for y in x) if isinstance(x, list) else share * x
            for key, x in strong_effect(kind, at).items()
        }
        for against in ABSCISSAE if has_abscissa(core.effect_record(kind)) else (None,):
            yield PlacedEffect(kind, at, wheelset, words, against)


def company(kind: str) -> list[Design]:
    """Designs of a law in an order that mixes its numbers, places, wheelsets and choices."""
    effects = [effect for share in SHARES for effect in placed(kind, share)]
    soft = [BOGIE.with_values({"vehicle.primary.lateral_stiffness": c}) for c in (3e6, 4e6, 2.5e6)]
    designs = [soft[i % len(soft)].with_effects([effect]) for i, effect in enumerate(effects)]
    order = np.random.default_rng(5).permutation(len(designs))
    return [designs[i] for i in order]


def ridden(found: dict[str, Any]) -> dict[str, Any]:
    """Result without the keys that only a single ride computes."""
    return {**found, "reference": None, "forces": None}


@pytest.mark.parametrize("kind", KINDS)
def test_designs_in_a_batch_have_the_same_ride_quality_as_alone(kind: str) -> None:
    designs, road = company(kind), excitation_of(TRACK, 40.0)
    together = ride_many(designs, TRACK, 40.0)
    for design, found in zip(designs, together, strict=True):
        assert ridden(found) == ridden(simulate_rides([Model(design)], road, 1)[0]), design.effects


@pytest.mark.parametrize("kind", KINDS)
def test_designs_in_a_batch_have_the_same_equilibrium_in_a_curve_as_alone(kind: str) -> None:
    designs = company(kind)[:12]
    for design, found in zip(designs, curve_many(designs, 800.0, 0.05), strict=True):
        assert found == curve(design, 800.0, 0.05), design.effects


@pytest.mark.parametrize("kind", KINDS)
def test_designs_in_a_batch_have_the_same_stability_as_alone(kind: str) -> None:
    models = [Model(design) for design in company(kind)[:24]]
    for members in group_by_structure(models):
        together = linear_stability_many(models[members[0]], np.stack([models[i].row for i in members]), [20.0, 60.0])
        for k, i in enumerate(members):
            alone = linear_stability_many(models[i], models[i].row[None], [20.0, 60.0])
            assert all(np.array_equal(each[k], alone[key][0], equal_nan=True) for key, each in together.items())


def of_curve(against: str, scale: float = 1.0) -> Design:
    """The bogie with the same curve of force against one motion or another."""
    motion, force = (-0.02, 0.0, 0.02), tuple(scale * f for f in (6e3, 0.0, -6e3))
    curved = PlacedEffect("measured_force", "secondary_lateral", None, {"motion": motion, "force": force}, against)
    return BOGIE.with_effects([curved])


@pytest.mark.parametrize("order", [ABSCISSAE, ABSCISSAE[::-1]], ids=" ".join)
def test_curves_against_displacement_speed_and_distance_never_share_lanes(order: Sequence[str]) -> None:
    designs, road = [of_curve(against) for against in order], excitation_of(TRACK, 40.0)
    alone = [simulate_rides([Model(design)], road, 1)[0]["score"] for design in designs]
    assert len(set(alone)) == len(order)
    assert [found["score"] for found in ride_many(designs, TRACK, 40.0)] == alone
    standing = [curve(design, 800.0, 0.1)["displacement"] for design in designs]
    assert [found["displacement"] for found in curve_many(designs, 800.0, 0.1)] == standing
    assert list(group_by_structure([Model(design) for design in designs])) == [[0], [1], [2]]
    assert list(group_by_structure([Model(of_curve("v", scale)) for scale in (1.0, 2.0)])) == [[0, 1]]


def test_rigs_of_another_input_never_share_lanes() -> None:
    text = "vehicle: {{rig: {{mass: {0}, stiffness: 60, damping: 1, gain: 1, input: {1}}}}}\n"
    inputs = ("force", "base_displacement", "base_acceleration")
    models = [Model(load_design(text.format(mass, word))) for mass in (1, 2) for word in inputs]
    assert list(group_by_structure(models)) == [[0, 3], [1, 4], [2, 5]]
    assert len({len(model.row) for model in models}) == 1
