"""Couplings between places: against the kernel's own spring, found where they are, silent where they are not."""

from __future__ import annotations

import numpy as np
import pytest

from railui import core
from railui.identification.structure.candidates import Candidate, CandidateBatch
from railui.identification.structure.couplings import answered, find_couplings, tried
from railui.identification.structure.equivalent_inputs import DELAY, pulses
from railui.identification.structure.score_test import output_differences
from railui.track import input_table
from tests.blind.made import calibrated

K = 6e6  # N/m


@pytest.mark.parametrize(
    ("kind", "strength", "against"), [("spring", "stiffness", "z"), ("viscous_damper", "damping", "v")]
)
def test_a_place_coupled_with_itself_is_twice_a_negative_spring_or_damper(kind: str, strength: str, against: str):
    fit, place = calibrated(), ("primary_lateral", 1)
    bundle = CandidateBatch((Candidate(kind, *place, ({strength: K},)),), ((0, 0),))
    spring, fine = output_differences(fit, 0, bundle)
    coupled = answered(fit, fit.segments[0], [(((place, place),), against)])
    assert fine.all()
    rest = np.linalg.norm(spring[0] + 0.5 * K * coupled[0]) / np.linalg.norm(spring[0])
    assert rest < 0.1  # the speed of a run wanders, that of an answer stands


@pytest.mark.parametrize("hertz", [3.0, 12.0])
def test_a_sum_of_pulses_answers_as_the_vehicle_does_to_the_force_itself(hertz: float):
    fit, port = calibrated(), ("wheelset", 1)
    target, seconds = fit.segments[0], 5.0
    stretch, channels = target.segment, target.segment.channels
    dt, v, n = stretch.dt, stretch.mean_speed, round(seconds / stretch.dt)
    pulse = pulses(fit, target, [port], seconds, np.ones(len(channels)))[port]
    t, fine = np.arange(n) * dt, np.arange(8 * n) * dt / 8
    table = input_table(t, v * t, np.full(n, v), np.zeros(n), None, None, fit.model.half_wheelbase(), target.steps)
    force = np.sin(2 * np.pi * hertz * fine)
    row = core.effect_numbers("measured_force", {"motion": v * fine, "force": 100.0 * force})
    vehicles = fit.model.vehicles((), [core.Placement("measured_force", *port, len(row), "s")])
    batch = fit.model.batch(fit.model.row[None], np.array([row]), np.ones((1, 1)))
    exact = vehicles.simulate(batch, table, dt, target.steps, channels)[0][0] / 100.0
    summed = np.stack([np.convolve(h, force[::8])[DELAY : DELAY + n] for h in pulse])
    rest = np.linalg.norm((summed - exact)[:, n // 2 :], axis=1) / np.linalg.norm(exact[:, n // 2 :], axis=1)
    assert np.all(rest < 0.015)


def test_a_slanting_arm_is_seen_where_it_is_and_explains_most():
    best = find_couplings(calibrated("lateral_yaw_coupling at=primary_lateral stiffness=4e6"))[0]
    assert best.text == "primary_lateral with primary_yaw on both wheelsets"
    assert (best.at, best.wheelset, best.against) == ("primary_lateral", None, "z")
    assert best.share > 0.5


@pytest.mark.slow
def test_crossed_damping_is_seen_between_the_wheelsets():
    best = find_couplings(calibrated("crossed_damping at=wheelset damping=2e4"))[0]
    assert best.text == "wheelset_yaw 1 with wheelset 2" and best.against == "v"
    assert best.share > 0.25


def test_where_nothing_is_missing_no_coupling_explains_a_fiftieth():
    assert find_couplings(calibrated())[0].share < 0.02


def test_every_pair_is_tried_once():
    all_pairs = tried()
    assert len(all_pairs) == len({frozenset(map(frozenset, pairs)) for pairs in all_pairs}) == 15 + 3
