"""Coach of a design file, verified against an independent Newton-Euler model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from railui.running_stability.limit_cycles import find_limit_cycles
from railui.track.excitation import Excitation, resolve_track
from railui.vehicle.design_reader import PlacedEffect, load_design
from railui.vehicle.model import Model
from tests.truth import coach as truth

MODEL = Model(load_design(Path(__file__).parents[2] / "designs/manchester_coach.yaml"))
COACH = truth.Coach()
TRACK = "erri_b176_high length=60 seed=2 spacing=0.1"


def rails(row: NDArray[np.float64]) -> NDArray[np.float64]:
    """y_w, dy_w/ds, phi_w, dphi_w/ds of four wheelsets from rows of the input table."""
    return row[..., 2:22].reshape(*row.shape[:-1], 4, 5)[..., :4]


def test_it_has_seventeen_degrees_of_freedom_and_four_wheelsets() -> None:
    freedoms = MODEL.vehicles().degrees_of_freedom(MODEL.single_batch())
    assert len(freedoms) == 17 and freedoms[:3] == ["y.body", "psi.body", "phi.body"]
    assert MODEL.wheelset_spacing() == pytest.approx((0.0, 2.56, 19.0, 21.56))


@pytest.mark.parametrize("speed", [10.0, 40.0, 90.0])
def test_eigenvalues_agree_with_the_independent_model(speed: float) -> None:
    found = np.sort_complex(MODEL.eigenvalues(speed)[0])
    known = np.sort_complex(np.linalg.eigvals(truth.state_matrix(COACH, speed)))
    apart = [np.abs(known - z).min() for z in found]
    assert np.max(apart) < 1e-9 * np.abs(known).max()


def test_state_derivatives_agree_with_the_independent_model_in_random_states() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        x = np.concatenate([rng.normal(0.0, 0.02, 17), rng.normal(0.0, 0.1, 17)])
        row = np.zeros(24)
        row[1], row[2:22] = 45.0, rng.normal(0.0, 2e-3, 20)
        found = MODEL.vehicles().state_derivatives(MODEL.single_batch(), row, x[None])[0]
        known = truth.rate(COACH, x, 45.0, rails(row))
        assert found == pytest.approx(known, rel=1e-9, abs=1e-8)


def test_a_simulation_agrees_with_the_independent_model() -> None:
    road = Excitation(resolve_track(TRACK), 55.0)
    table = road.table(MODEL.wheelset_spacing(), 1)
    channels = MODEL.vehicles().degrees_of_freedom(MODEL.single_batch())
    found, lost = MODEL.vehicles().simulate(MODEL.single_batch(), table, road.dt, 1, channels)
    known = truth.march(COACH, 55.0, road.dt, rails(table))[:, :17]
    assert lost[0] == -1
    assert np.abs(found[0].T - known).max(axis=0) == pytest.approx(0.0, abs=1e-4 * known.std(axis=0).min())


def test_wheelsets_meet_an_offset_running_line_one_after_the_other() -> None:
    edge = PlacedEffect("rolling_line", "contact", None, {"place": (100.0, 100.001), "offset": (0.0, 2e-3)})
    worn, row = Model(MODEL.design.with_effects([edge])), np.zeros(24)
    behind = MODEL.wheelset_distances()
    turns = [MODEL.vehicles().degrees_of_freedom(MODEL.single_batch()).index(f"psi.wheelset_{i}") for i in (1, 2, 3, 4)]
    # (3.3), (3.5) by hand: a radius difference lambda e_0 turns a wheelset by 2 b N kappa_x lambda e_0/(r I_z)
    turn = 2 * 0.75 * 54.546e3 * 140.0 * 0.1 * 2e-3 / (0.46 * 1120.0)
    for s in [99.0, *(100.01 + x for x in behind)]:
        row[:2] = s, 45.0
        found = worn.vehicles().state_derivatives(worn.single_batch(), row, np.zeros((1, 34)))[0][17:][turns]
        assert found == pytest.approx([turn if s - x > 100.0 else 0.0 for x in behind], rel=1e-9)


def test_on_steadily_canted_rails_every_body_slides_down_the_slope_alike() -> None:
    phi = 0.01
    freedoms = MODEL.vehicles().degrees_of_freedom(MODEL.single_batch())
    design = MODEL.design
    heights = {"body": 1.8, "frame_1": 0.6, "frame_2": 0.6}
    x = np.zeros(34)
    for i, name in enumerate(freedoms):
        letter, _, body = name.partition(".")
        # turned about the middle of the track as one piece
        x[i] = phi if letter == "phi" else phi * heights.get(body, 0.46) if letter == "y" else 0.0
    row = np.zeros(24)
    row[1], row[[4, 9, 14, 19]] = 40.0, phi
    free = Model(
        design.with_values({"contact.wheels.roll": 0.0, "contact.wheels.contact_angle": 0.0, "contact.spin_creep": 0.0})
    )
    found = free.vehicles().state_derivatives(free.single_batch(), row, x[None])[0][17:]
    lateral = [a for a, name in zip(found, freedoms, strict=True) if name.startswith("y.")]
    turning = [a for a, name in zip(found, freedoms, strict=True) if not name.startswith("y.")]
    assert lateral == pytest.approx(np.full(7, 9.81 * phi), rel=2e-3)  # as far as the loads are rounded
    assert turning == pytest.approx(np.zeros(10), abs=1e-3)


def test_a_softer_anti_roll_bar_lets_the_body_roll_more_slowly() -> None:
    soft = Model(MODEL.design.with_values({"vehicle.elements.anti_roll_bar.stiffness": 0.0}))
    slow = [min(abs(z.imag) for z in m.eigenvalues(30.0)[0] if z.imag and z.real > -5) for m in (soft, MODEL)]
    assert slow[0] < slow[1]


def test_hunting_decays_below_the_linear_critical_speed() -> None:
    found = find_limit_cycles(MODEL, [70.0, 80.0, 90.0], diagram=False)
    assert found.is_subcritical and found.critical_speed == pytest.approx(76.97, abs=0.05)  # linear: 82.59 m/s
