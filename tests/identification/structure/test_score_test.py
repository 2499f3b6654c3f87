"""The trace: what it names on planted effects, what it says of noise, and which candidates it looks for."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from railui.identification.estimation.problem import truncate
from railui.identification.loop import calibrate
from railui.identification.structure.candidates import Candidate, batch_candidates, list_candidates
from railui.identification.structure.evidence import ScoreResult, family_wise_test, signed_rho
from railui.identification.structure.refit import select_candidates
from railui.identification.structure.score_test import ScoreTestResult, score_test
from railui.identification.structure.stepwise import OBVIOUS, STRUCTURED, has_structure
from tests.blind.made import calibrated, simulated_campaign
from tests.truth.campaign import noisy
from tests.truth.effects import effect, sense

BRIEF = (25.0, 12.0)  # s; the trace reads the first run alone
PLANTED = {
    "free_play": "free_play at=primary_lateral half_width=4e-4",
    "dry_friction": "dry_friction at=secondary_lateral force=1500 slip_speed=5e-3",
    "gauge_conicity": "gauge_conicity at=contact per_gauge=-40",
}


def traced(fit, measurement):
    return score_test(fit, list_candidates(fit.model, measurement.adjust), jobs=2)


def test_with_nothing_missing_no_candidate_explains_two_hundredths():
    assert traced(calibrated(), simulated_campaign().dataset).rho2 < 0.02


@pytest.mark.parametrize("kind", PLANTED)
def test_a_planted_effect_is_first(kind: str):
    more = {} if kind == "free_play" else {"seconds": BRIEF}
    one, fit = simulated_campaign(PLANTED[kind], **more), calibrated(PLANTED[kind], **more)
    seen = traced(fit, one.dataset)
    first = seen.best[0].candidate
    assert (first.kind, first.at, first.wheelset) == (kind, one.truth.order.effects[0].at, None)
    assert seen.rho2 > 0.05
    assert seen.p < 0.01


DAMPER = "viscous_damper at=wheelset_yaw wheelset=2 damping=2e5"
MINUTE = (60.0, 12.0)  # s; within it the speed wanders by several per cent


def yaw_damper(model, stretches) -> Candidate:
    """The candidate that is planted."""
    found = list_candidates(model, stretches)
    return next(c for c in found if (c.kind, c.at, c.wheelset) == ("viscous_damper", "wheelset_yaw", 2))


def test_adjusting_takes_a_damper_of_a_wheelsets_yaw_for_creep():
    # M_psi = -2 b^2 N kappa_x (psi' / V + lambda e / (b r)): kappa_x + V c / (2 b^2 N), lambda kappa_x as it was
    fit, stretches = calibrated(), simulated_campaign().dataset.estimation
    one = yaw_damper(fit.model, stretches)
    [seen] = score_test(fit, [one], jobs=2).results
    absorbed = dict(zip(fit.free.paths, seen.absorbed, strict=True))
    c = one.shapes[0]["damping"]
    geometry, load = "vehicle.geometry.half_gauge", "vehicle.wheel_load"
    b, n = (fit.model.design.values[path] for path in (geometry, load))
    creep = stretches[0].mean_speed * c / (2 * b**2 * n)
    kappa, conicity = (fit.model.value(f"contact.trailing.{key}") for key in ("longitudinal_creep", "conicity"))
    assert absorbed["contact.trailing.longitudinal_creep"] == pytest.approx(creep, rel=0.03)
    assert absorbed["contact.trailing.conicity"] == pytest.approx(-conicity * creep / kappa, rel=0.03)
    assert seen.own < 1e-3


def test_what_a_varying_speed_alone_tells_from_creep_is_first_with_the_amount_that_was_planted():
    one, fit = simulated_campaign(DAMPER, seconds=MINUTE), calibrated(DAMPER, seconds=MINUTE)
    first = truncate(fit.segments, one.dataset, 12.0)  # as good as one speed
    seen = score_test(fit, list_candidates(fit.model, one.dataset.estimation), first=first, jobs=2)
    best = seen.best[0]
    assert (best.candidate.kind, best.candidate.at, best.candidate.wheelset) == ("viscous_damper", "wheelset_yaw", 2)
    assert best.amount * best.candidate.shapes[best.shape]["damping"] == pytest.approx(2e5, rel=0.3)
    assert seen.rho2 > 0.05
    assert seen.p < 0.01


def test_a_late_sensor_is_first():
    one = simulated_campaign()
    order, clean = one.truth.order, one.truth.clean["a"]
    late = sense(clean, clean["t"], [effect("sensor_delay", "ay1", delay=0.01)])
    columns = noisy(late, order, np.random.default_rng(8))
    stretch = replace(
        one.dataset.estimation[0], columns={**one.dataset.estimation[0].columns, **columns}, tables={}
    )
    measurement = replace(one.dataset, segments=(stretch, *one.dataset.validation))
    fit = calibrate(measurement, one.nominal, jobs=2)
    first = traced(fit, measurement).best[0]
    assert (first.candidate.kind, first.candidate.at) == ("sensor_delay", "ay1")
    # the amount counts in the delay of the candidate's own shape
    assert first.amount * first.candidate.shapes[first.shape]["delay"] == pytest.approx(0.01, rel=0.5)


def made_up(rng: np.random.Generator, kinds: list[Candidate], blocks: int = 40) -> list[ScoreResult]:
    """Sightings of pure noise, a third of it common to all."""
    common = rng.standard_normal(blocks)
    scores = [rng.standard_normal(blocks) + 0.6 * common for _ in kinds]
    return [ScoreResult(c, 0, float(s.sum()), 1.0, s, 1.0) for c, s in zip(kinds, scores, strict=True)]


TWO_SIDED = [Candidate("cubic_stiffness", "primary_lateral", w) for w in (None, 1, 2)] * 4
ONE_SIDED = [Candidate("dry_friction", "primary_lateral", w) for w in (None, 1, 2)] * 4


@pytest.mark.parametrize("blocks", [12, 40])
def test_the_family_wise_p_of_noise_is_even(blocks: int):
    rng = np.random.default_rng(1)
    p = np.array([family_wise_test(made_up(rng, [*TWO_SIDED, *ONE_SIDED], blocks), seed)[0] for seed in range(200)])
    assert 0.35 < np.median(p) < 0.65
    for level in (0.01, 0.05, 0.2, 0.8):
        # four binomial deviations
        assert np.mean(p <= level) == pytest.approx(level, abs=4.0 * np.sqrt(level * (1.0 - level) / len(p)))


def test_the_critical_score_is_beyond_what_noise_reaches_in_a_hundred_libraries_but_one():
    rng = np.random.default_rng(2)
    over = 0
    for seed in range(100):
        seen = made_up(rng, TWO_SIDED, 20)
        over += max(abs(s.z) for s in seen) > family_wise_test(seen, seed)[1]
    assert over <= 4


def test_a_negative_rho_is_no_evidence_for_a_one_sided_candidate():
    scores = np.random.default_rng(3).standard_normal(40) - 3.0
    friction, cubic = (ScoreResult(c[0], 0, -0.6, -1.0, scores, 1.0) for c in (ONE_SIDED, TWO_SIDED))
    assert signed_rho(friction) == 0.0
    assert signed_rho(cubic) == pytest.approx(0.6)
    assert family_wise_test([friction], 0)[0] > 0.99
    assert family_wise_test([cubic], 0)[0] < 0.01


def test_without_sightings_nothing_is_significant():
    assert family_wise_test([], 0)[0] == 1.0


def library(**more) -> list[Candidate]:
    return list_candidates(calibrated().model, simulated_campaign().dataset.estimation, **more)


def test_bundles_hold_every_shape_of_every_candidate_once():
    found = library()
    held = Counter((pack.members[member], shape) for pack in batch_candidates(found) for member, shape in pack.lanes)
    assert held == Counter((c, shape) for c in found for shape in range(len(c.shapes)))


def test_a_lane_of_a_bundle_has_a_little_of_its_own_effect_alone():
    for pack in batch_candidates(library()):
        amounts = pack.amounts(0.05)
        assert np.all((amounts > 0).sum(axis=1) == 1)
        assert [int(row.argmax()) for row in amounts] == [member for member, _ in pack.lanes]
        assert len(pack.numbers()) == len(pack.lanes)


def test_candidates_have_shapes_and_stand_once_each():
    found = library()
    assert len(found) == len(set(found)) > 80
    assert all(c.shapes for c in found)
    assert {(c.at, c.wheelset) for c in found if c.kind == "free_play"} >= {
        ("primary_lateral", w) for w in (None, 1, 2)
    }


@pytest.mark.parametrize(
    ("kind", "ratio"), [("maxwell_damper", ("damping", "stiffness")), ("hysteresis", ("yield", "stiffness"))]
)
def test_an_effect_with_memory_scaled_keeps_its_time_constant_or_its_length_of_slip(kind: str, ratio: tuple[str, str]):
    one = next(c for c in library() if (c.kind, c.at) == (kind, "secondary_lateral"))
    shape, scaled = one.shapes[1], one.scaled(one.shapes[1], 0.3)
    over, under = ratio
    assert scaled[over] / scaled[under] == pytest.approx(shape[over] / shape[under])
    assert scaled["stiffness"] == pytest.approx(0.3 * shape["stiffness"])


def test_of_a_friction_scaled_the_slip_speed_stays():
    one = next(c for c in library() if (c.kind, c.at) == ("dry_friction", "secondary_lateral"))
    scaled = one.scaled(one.shapes[0], 0.3)
    assert scaled == pytest.approx({**one.shapes[0], "force": 0.3 * one.shapes[0]["force"]})


def test_barred_kinds_are_no_candidates():
    barred = {"free_play", "bump_stop"}
    assert {c.kind for c in library()} - {c.kind for c in library(without=barred)} == barred


def test_a_track_measured_under_load_bars_the_rails():
    assert {c.kind for c in library()} - {c.kind for c in library(loaded=True)} == {"rail_flexibility"}


def test_without_a_gauge_there_is_no_gauge_conicity():
    stretch = simulated_campaign().dataset.estimation[0]
    bare = replace(stretch, columns={k: x for k, x in stretch.columns.items() if k != "gauge"}, tables={})
    kinds = {c.kind for c in list_candidates(calibrated().model, [bare])}
    assert {c.kind for c in library()} - kinds == {"gauge_conicity"}


def test_where_the_coach_is_measured_nothing_else_acts():
    stretch = simulated_campaign().dataset.estimation[0]
    driven = replace(stretch, columns={**stretch.columns, "Qy": np.zeros(stretch.samples)}, tables={})
    places = {c.at for c in list_candidates(calibrated().model, [driven])}
    assert "secondary_lateral" not in places
    assert "secondary_yaw" in places


def test_an_effect_of_the_model_is_no_candidate_again():
    one = next(c for c in library() if (c.kind, c.at, c.wheelset) == ("free_play", "primary_lateral", None))
    model = calibrated().model.with_effect(one.placed(one.shapes[3]))
    assert one not in list_candidates(model, simulated_campaign().dataset.estimation)


def test_only_measured_channels_have_sensors_to_blame():
    stretch = simulated_campaign().dataset.estimation[0]
    fewer = replace(stretch, columns={k: x for k, x in stretch.columns.items() if k != "d1"}, tables={})
    at = {c.at for c in list_candidates(calibrated().model, [fewer]) if c.kind == "sensor_delay"}
    assert at == {"e1", "e2", "ay1", "ay2", "ayf", "rf", "d2"}


def test_an_effect_that_speaks_in_few_blocks_alone_is_significant():
    rng = np.random.default_rng(4)
    norms = np.where(np.arange(36) % 12 == 5, 10.0, 0.1)  # three loud blocks of 36
    scores = 3.0 * norms + np.sqrt(norms) * rng.standard_normal(36)
    rare = ScoreResult(TWO_SIDED[0], 0, 0.9, 3.0, scores, float(norms.sum()), norms=norms)
    by_hand = [s - n * (scores.sum() - s) / (norms.sum() - n) for s, n in zip(scores, norms, strict=True)]
    np.testing.assert_allclose(rare.noise, by_hand)
    assert family_wise_test([rare], 0)[0] < 0.01
    assert family_wise_test([replace(rare, norms=np.zeros(0))], 0)[0] > 0.05  # as if its silence were noise


@pytest.mark.parametrize("loud", [1, 8])
def test_noise_of_candidates_that_speak_in_few_blocks_is_not_cried_for(loud: int):
    rng, p = np.random.default_rng(5), []
    for seed in range(300):
        norms = [np.where(rng.permutation(36) < loud, 10.0, 0.1) for _ in TWO_SIDED]
        seen = [
            ScoreResult(c, 0, 0.0, 0.0, np.sqrt(n) * rng.standard_normal(36), float(n.sum()), norms=n)
            for c, n in zip(TWO_SIDED, norms, strict=True)
        ]
        p.append(family_wise_test(seen, seed)[0])
    for level in (0.01, 0.05, 0.2):
        assert np.mean(np.array(p) <= level) < level + 4.0 * np.sqrt(level * (1.0 - level) / len(p))


def test_the_kin_of_the_best_at_its_place_is_fitted_however_far_down_it_is():
    others = [c for c in library() if c.at == "secondary_lateral" and c.kind not in ("hysteresis", "dry_friction")]
    kinds = ("hysteresis", "dry_friction")
    best, kin = (next(c for c in library() if (c.kind, c.at, c.wheelset) == (k, "primary_yaw", 2)) for k in kinds)
    far = next(c for c in library() if (c.kind, c.at) == ("dry_friction", "secondary_yaw"))
    rho = {best: 0.7} | dict.fromkeys(others, 0.4) | {kin: 0.1, far: 0.1}
    seen = tuple(ScoreResult(c, 0, r, r, np.full(36, r), 1.0) for c, r in rho.items())
    fitted = {s.candidate for s in select_candidates(ScoreTestResult(seen, seen, 1e-3, 4.0, 1.0))}
    assert kin in fitted and far not in fitted


def test_a_rest_of_which_a_candidate_explains_a_fifth_needs_no_test():
    def of(rho2: float, p: float) -> ScoreTestResult:
        return ScoreTestResult(
            (), (replace(made_up(np.random.default_rng(6), TWO_SIDED)[0], rho=np.sqrt(rho2)),), p, 4.0, 1.0
        )

    assert has_structure(of(1.01 * OBVIOUS, 0.5)) and not has_structure(of(0.99 * OBVIOUS, 0.5))
    assert has_structure(of(1.01 * STRUCTURED, 0.005)) and not has_structure(of(0.99 * STRUCTURED, 0.005))
