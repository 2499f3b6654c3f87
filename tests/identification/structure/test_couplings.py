"""Cross couplings: agreement with the kernel's spring, location of planted ones, no false detection."""

from __future__ import annotations

import numpy as np
import pytest

from railui import core
from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.structure.candidates import Candidate, CandidateBatch
from railui.identification.structure.couplings import candidate_couplings, coupling_responses, find_couplings
from railui.identification.structure.equivalent_inputs import PULSE_DELAY, impulse_responses
from railui.identification.structure.score_test import output_differences
from railui.track import input_table
from tests.blind.simulated import calibrated, simulated_campaign

K = 6e6  # N/m


@pytest.mark.parametrize(
    ("kind", "strength", "against"), [("spring", "stiffness", "z"), ("viscous_damper", "damping", "v")]
)
def test_a_location_coupled_with_itself_is_twice_a_negative_spring(kind: str, strength: str, against: str):
    fit, port = calibrated(), ("primary_lateral", 1)
    batch = CandidateBatch((Candidate(kind, *port, ({strength: K},)),), ((0, 0),))
    spring, is_valid = output_differences(LoopSettings(), fit.model, fit.segments[0], batch)
    coupled = coupling_responses(fit, fit.segments[0], [(((port, port),), against)])
    assert is_valid.all()
    error = np.linalg.norm(spring[0] + 0.5 * K * coupled[0]) / np.linalg.norm(spring[0])
    assert error < 0.1  # the speed of a run varies, that of an impulse response is constant


@pytest.mark.parametrize("hertz", [3.0, 12.0])
def test_the_response_to_a_sum_of_pulses_is_the_response_to_the_force(hertz: float):
    fit, port = calibrated(), ("wheelset", 1)
    target, seconds = fit.segments[0], 5.0
    segment, channels = target.segment, target.segment.channels
    dt, v, n = segment.dt, segment.mean_speed, round(seconds / segment.dt)
    response = impulse_responses(fit, target, [port], seconds, np.ones(len(channels)))[port]
    t, fine = np.arange(n) * dt, np.arange(8 * n) * dt / 8
    table = input_table(t, v * t, np.full(n, v), np.zeros(n), None, None, fit.model.wheelset_spacing(), target.steps)
    force = np.sin(2 * np.pi * hertz * fine)
    row = core.effect_numbers("measured_force", {"motion": v * fine, "force": 100.0 * force})
    vehicles = fit.model.vehicles((), [core.Placement("measured_force", *port, len(row), "s")])
    batch = fit.model.batch(fit.model.row[None], np.array([row]), np.ones((1, 1)))
    exact = vehicles.simulate(batch, table, dt, target.steps, channels)[0][0] / 100.0
    summed = np.stack([np.convolve(h, force[::8])[PULSE_DELAY : PULSE_DELAY + n] for h in response])
    error = np.linalg.norm((summed - exact)[:, n // 2 :], axis=1) / np.linalg.norm(exact[:, n // 2 :], axis=1)
    assert np.all(error < 0.015)


def test_an_inclined_arm_is_located_and_explains_most():
    arm = "lateral_yaw_coupling at=primary_lateral stiffness=4e6"
    best = find_couplings(simulated_campaign(arm).context, calibrated(arm))[0]
    assert best.text == "primary_lateral with primary_yaw on both wheelsets"
    assert (best.at, best.wheelset, best.against) == ("primary_lateral", None, "z")
    assert best.share > 0.5


@pytest.mark.slow
def test_crossed_damping_is_located_between_the_wheelsets():
    damping = "crossed_damping at=wheelset damping=2e4"
    best = find_couplings(simulated_campaign(damping).context, calibrated(damping))[0]
    assert best.text == "wheelset_yaw 1 with wheelset 2" and best.against == "v"
    assert best.share > 0.25


def test_without_an_unmodelled_effect_no_coupling_explains_a_fiftieth():
    assert find_couplings(simulated_campaign().context, calibrated())[0].share < 0.02


def test_every_pair_is_listed_once():
    all_pairs = candidate_couplings()
    assert len(all_pairs) == len({frozenset(map(frozenset, pairs)) for pairs in all_pairs}) == 15 + 3
