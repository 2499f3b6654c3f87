"""The verdict: share explained, what remains, and the rules over both, against hand calculation."""

from __future__ import annotations

import numpy as np
import pytest

from railui.campaign.settings.verdict import VerdictSettings
from railui.identification.estimation.noise_floor import NoiseFloor
from railui.identification.estimation.validation import Validation
from railui.identification.result import is_error_raised
from railui.identification.verdict import (
    Explained,
    Remainder,
    Verdict,
    decide_verdict,
    explained_share,
    remaining_ratio,
)


def test_effects_that_the_independent_test_contradicts_are_a_part_at_most():
    rules = {
        "has_effects": True,
        "explained": Explained(0.96, 0.004),
        "remainder": Remainder(0.04, 0.0, coherent=False, structured=False),
        "is_adequate": True,
        "is_noise": True,
        "has_discrepancy": False,
    }
    assert decide_verdict(VerdictSettings(), **rules) == Verdict.EFFECT
    assert decide_verdict(VerdictSettings(), **rules, is_contradicted=True) == Verdict.PARTIAL


@pytest.mark.parametrize(("is_noise", "expected"), [(False, Verdict.OUTSIDE), (True, Verdict.NONE)])
def test_a_vibration_above_noise_that_no_force_explains_is_outside(is_noise: bool, expected: Verdict):
    left = Remainder(1.0, 0.0, coherent=False, structured=False, vibration=5.0)
    rules = {"has_effects": False, "explained": None, "is_adequate": False, "has_discrepancy": False}
    assert decide_verdict(VerdictSettings(), remainder=left, is_noise=is_noise, **rules) == expected


@pytest.mark.parametrize("what", ["diverges", "is_shared"])
def test_a_model_without_effects_that_diverges_or_leaves_a_shared_residual_is_outside(what: str):
    left = Remainder(None, None, coherent=False, structured=False)
    rules = {"has_effects": False, "explained": None, "is_adequate": False, "has_discrepancy": False, "is_noise": False}
    assert decide_verdict(VerdictSettings(), remainder=left, **rules) == Verdict.NONE
    assert decide_verdict(VerdictSettings(), remainder=left, **rules, **{what: True}) == Verdict.OUTSIDE


@pytest.mark.parametrize(("rise", "level"), [(0.0, 0.01), (0.5, 0.01)])
def test_a_higher_error_is_significant_by_chance_as_often_as_its_level_says(rise: float, level: float):
    rng = np.random.default_rng(7)
    found = [is_error_raised(np.ones(8), 1.0 + rise + rng.normal(0.0, 0.2, 8), level) for _ in range(2000)]
    assert np.mean(found) > 0.95 if rise else 0.005 < np.mean(found) < 0.016


@pytest.mark.parametrize(("before", "after", "raised"), [(1.0, np.nan, True), (np.nan, np.nan, False)])
def test_effects_with_which_the_vehicle_diverges_raise_the_error(before: float, after: float, raised: bool):
    assert is_error_raised(np.full(4, before), np.full(4, after), 0.01) is raised


def validation(*block_errors: float) -> Validation:
    blocks = np.array(block_errors)
    return Validation({"z": float(np.sqrt(blocks.sum()))}, float(np.sqrt(blocks.sum())), (), (), blocks)


def floor(nrmse: float, sd: float = 0.0) -> NoiseFloor:
    return NoiseFloor(nrmse, sd, {}, nrmse)


def diverged() -> Validation:
    return Validation({}, float("nan"), (), (("run_b.csv", 3.0),), np.full(2, np.nan))


def test_a_remainder_names_nothing_that_was_not_found():
    remainder = Remainder(0.0, 0.0, coherent=False, structured=False)
    assert (remainder.candidate, remainder.at, remainder.wheelset, remainder.surface) == (None, None, None, None)
    assert remainder.vibration is None


def test_the_share_explained_is_that_of_the_error_beyond_noise():
    explained = explained_share(validation(0.05, 0.05), validation(0.02, 0.02), floor(0.1))
    assert explained is not None
    assert explained.value == pytest.approx((0.10 - 0.04) / (0.10 - 0.01))
    assert explained.standard_error == pytest.approx(0.0, abs=1e-12)


def test_the_standard_error_is_that_of_a_ratio_over_blocks():
    before, after = np.array([0.05, 0.07, 0.04, 0.06]), np.array([0.01, 0.03, 0.01, 0.02])
    explained = explained_share(validation(*before), validation(*after), floor(0.1))
    assert explained is not None and explained.standard_error is not None
    n, total = 4, before.sum() - 0.01
    scatter = (before - after) - explained.value * (before - 0.01 / n)
    assert explained.standard_error == pytest.approx(np.sqrt(n) * scatter.std(ddof=1) / total)


def test_the_spread_of_the_floor_widens_the_standard_error():
    parts = validation(0.05, 0.05), validation(0.02, 0.02)
    explained = explained_share(*parts, floor(0.1, sd=0.01))
    assert explained is not None
    # d explained / d floor^2 = (before^2 - after^2)/(before^2 - floor^2)^2
    assert explained.standard_error == pytest.approx(0.06 / 0.09**2 * 2 * 0.1 * 0.01)


@pytest.mark.parametrize(("after", "value"), [((0.001, 0.001), 1.0), ((0.1, 0.1), 0.0)])
def test_the_share_explained_lies_between_none_and_all(after: tuple[float, float], value: float):
    explained = explained_share(validation(0.05, 0.05), validation(*after), floor(0.1))
    assert explained is not None and explained.value == value


def test_nothing_is_to_be_explained_at_the_noise_floor():
    assert explained_share(validation(0.005, 0.0051), validation(0.005, 0.005), floor(0.1, sd=0.01)) is None


def test_nothing_is_to_be_explained_below_a_floor_of_one_realisation():
    assert explained_share(validation(0.005, 0.0049), validation(0.005, 0.005), floor(0.1, sd=np.nan)) is None


def test_a_calibrated_model_that_diverges_counts_as_one_that_does_not_move():
    explained = explained_share(diverged(), validation(0.02, 0.02), floor(0.1))
    assert explained == Explained(pytest.approx((1.0 - 0.04) / (1.0 - 0.01)), None)


def test_an_unknown_noise_floor_makes_the_share_a_lower_bound():
    explained = explained_share(validation(0.05, 0.05), validation(0.02, 0.02), floor(float("nan"), float("nan")))
    assert explained is not None and explained.value == pytest.approx((0.10 - 0.04) / 0.10)
    assert explained.standard_error == pytest.approx(0.0, abs=1e-12)


def test_a_model_that_diverges_is_reduced_by_what_is_better_than_no_motion():
    assert diverged().error_reduction(validation(0.02, 0.02)) == pytest.approx((0.96, 0.0, 0))
    assert diverged().error_reduction(validation(20.0, 5.0))[0] < 0.0  # no gain
    assert validation(0.05, 0.05).error_reduction(diverged())[0] == -np.inf


def test_nothing_is_known_where_the_final_model_diverges():
    assert explained_share(validation(0.05, 0.05), diverged(), floor(0.1)) is None
    assert remaining_ratio(validation(0.05, 0.05), diverged(), floor(0.1)) is None


def test_nothing_is_known_where_the_floor_is_unknown():
    assert remaining_ratio(validation(0.25), validation(0.09), floor(np.nan)) is None


def test_the_remainder_is_the_share_of_the_error_beyond_noise_that_is_left():
    ratio = remaining_ratio(validation(0.05, 0.05), validation(0.02, 0.02), floor(0.1))
    assert ratio == pytest.approx((0.04 - 0.01) / (0.10 - 0.01))


def remainder(*, structured: bool = False, coherent: bool = False) -> Remainder:
    return Remainder(0.1, None, coherent, structured)


def verdict(share: float, left: Remainder, *, accepted: bool, outside: bool = False, adequate: bool = False) -> Verdict:
    return decide_verdict(
        VerdictSettings(),
        has_effects=accepted,
        explained=Explained(share, 0.01),
        remainder=left,
        is_adequate=adequate,
        is_noise=True,
        has_discrepancy=outside,
    )


def test_an_effect_that_explains_nine_tenths_is_the_effect_whatever_is_left():
    assert verdict(0.91, remainder(structured=True, coherent=True), accepted=True, outside=True) == "effect"


@pytest.mark.parametrize("left", [remainder(structured=True), remainder(coherent=True)])
def test_an_effect_that_explains_less_and_leaves_a_structure_is_a_part(left: Remainder):
    assert verdict(0.71, left, accepted=True) == "partial"


def test_an_effect_with_a_discrepancy_beside_it_is_a_part():
    assert verdict(0.71, remainder(), accepted=True, outside=True) == "partial"


def test_an_effect_that_leaves_no_structure_is_the_effect():
    assert verdict(0.71, remainder(), accepted=True) == "effect"
    assert verdict(0.71, remainder(structured=True), accepted=True, adequate=True) == "effect"


def test_an_effect_that_leaves_many_noise_floors_is_a_part_whatever_their_structure():
    rules = {"is_adequate": False, "is_noise": True, "has_discrepancy": False}

    def verdict_of(share: float, *, exceeds: bool) -> Verdict:
        explained = Explained(share, 0.01)
        settings, left = VerdictSettings(), remainder()
        return decide_verdict(
            settings, has_effects=True, explained=explained, remainder=left, **rules, exceeds_noise=exceeds
        )

    assert verdict_of(0.62, exceeds=True) == "partial" and verdict_of(0.62, exceeds=False) == "effect"
    assert verdict_of(0.95, exceeds=True) == "effect"


def test_effects_with_which_the_model_diverges_are_no_whole_explanation():
    left = remainder()
    rules = {"explained": None, "remainder": left, "is_adequate": True, "is_noise": True, "has_discrepancy": False}
    verdicts = [decide_verdict(VerdictSettings(), has_effects=True, **rules, diverges=x) for x in (False, True)]
    assert verdicts == ["effect", "partial"]


def test_without_an_effect_the_verdict_is_outside_or_none():
    assert verdict(0.0, remainder(structured=True), accepted=False, outside=True) == "outside"
    assert verdict(0.0, remainder(structured=True), accepted=False) == "none"


@pytest.mark.parametrize(
    ("left", "found", "expected"),
    [
        ({}, {}, "none"),
        ({"structured": True, "coherent": True}, {"is_noise": True}, "none"),
        ({"structured": True}, {}, "outside"),
        ({"coherent": True}, {}, "outside"),
        ({}, {"has_discrepancy": True, "is_noise": True}, "outside"),
        ({}, {"has_freed_members": True, "is_noise": True}, "outside"),
        ({}, {"is_out_of_time": True}, "outside"),
        ({}, {"is_out_of_time": True, "is_noise": True}, "none"),
    ],
)
def test_the_rules_without_an_effect(left: dict[str, bool], found: dict[str, bool], expected: str):
    rules = {"is_noise": False, "has_discrepancy": False} | found
    without = {"has_effects": False, "explained": None, "is_adequate": False}
    assert decide_verdict(VerdictSettings(), remainder=remainder(**left), **without, **rules) == expected


def test_the_words_of_the_verdict_are_those_of_the_reports():
    assert [v.value for v in Verdict] == ["none", "effect", "partial", "outside", "data"]


def test_a_remainder_is_not_located_unless_stated():
    left = remainder()
    assert left.candidate is None and left.at is None and left.wheelset is None


@pytest.mark.parametrize(("sd", "is_explained"), [(0.6, True), (0.75, False)])
def test_an_error_within_twice_the_spread_of_the_floor_is_not_to_be_explained(sd: float, is_explained: bool):
    # 1^2 - 0.5^2 = 0.75 against 2 x 0.5 x sd
    explained = explained_share(validation(0.5, 0.5), validation(0.2, 0.2), floor(0.5, sd))
    assert (explained is not None) == is_explained


def test_the_remainder_of_a_calibrated_model_that_diverges_is_that_of_one_that_does_not_move():
    ratio = remaining_ratio(diverged(), validation(0.02, 0.02), floor(0.1))
    assert ratio == pytest.approx((0.04 - 0.01) / (1.0 - 0.01))


def test_nothing_remains_of_an_error_that_is_the_floor():
    assert remaining_ratio(validation(0.25), validation(0.09), floor(0.5)) is None


def test_an_effect_that_explains_just_the_least_share_is_the_effect():
    share = VerdictSettings().min_explained_share
    assert verdict(share, remainder(structured=True), accepted=True) == "effect"
