"""Score and class of a ride."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from railui.ride_quality.comfort import MIN_BLOCKS, goods_index
from railui.ride_quality.score import CLASSES, SCORE_KEYS, classify, evaluate_ride, score_many

CLEARANCE = 0.007
LONG = SimpleNamespace(use="long_distance", journey=4 * 3600.0, comfort_weight=0.6, admissible_flange_fraction=0.05)
LOCAL = SimpleNamespace(use="local", journey=3600.0, comfort_weight=0.4, admissible_flange_fraction=0.05)
GOODS = SimpleNamespace(**(vars(LOCAL) | {"use": "goods", "journey": 3600.0, "rms_limit": 2.0, "peak_limit": 4.0}))


def ride(**more):
    """Statistics of a fair ride."""
    fair = {
        "mean_e": np.array([1e-4, -2e-4]),
        "sd_e": np.array([2.0e-3, 1.5e-3]),
        "flange_fractions": np.array([0.001, 0.0]),
        "weighted_acceleration": 0.08,
        "weighted_acceleration_1974": 0.1,
        "wz": 0.12,
        "block_rms": np.full(80, 0.08),
    }
    return fair | more


def test_the_score_is_the_weighted_sum_of_both_parts():
    # by hand; leading wheelset: x = 6.9/2 and 7.1/2, trailing 6.8/1.5 and 7.2/1.5
    tails = [0.5 * (math.erfc(3.45 / math.sqrt(2)) + math.erfc(3.55 / math.sqrt(2)))]
    tails += [0.5 * (math.erfc(6.8 / 1.5 / math.sqrt(2)) + math.erfc(7.2 / 1.5 / math.sqrt(2)))]
    guidance = math.log(0.05 / max(tails)) / math.log(0.05 / 1e-6)
    slope = math.log(8 / 4) / math.log(0.224 / 0.355)  # 0.1 * 3.15 lies between 8 h and 4 h
    hours = 4 * math.exp(slope * math.log(0.315 / 0.355))
    comfort = math.log(60 * hours) / math.log(1440)
    result = evaluate_ride(ride(), LONG, CLEARANCE)
    assert result["comfort_hours"] == pytest.approx(hours, rel=1e-12)
    assert result["flange_fraction_gaussian"] == pytest.approx(max(tails), rel=1e-12)
    assert result["flange_margin"] == pytest.approx(3.45, rel=1e-12)
    assert result["score"] == pytest.approx(100 * (0.6 * comfort + 0.4 * guidance), rel=1e-12)
    assert result["wz"] == pytest.approx(4.42 * 0.12**0.3)
    assert result["n_mv"] == pytest.approx(0.48)
    assert result["flange_fraction"] == 0.001 and result["flange_fractions"] == [0.001, 0.0]


def test_a_result_has_the_keys_of_the_command_and_goes_into_json():
    result = evaluate_ride(ride(block_rms=[]), LONG, CLEARANCE)
    assert list(result) == [*SCORE_KEYS, "notes"]
    assert result["n_mv"] is None and any("n_mv" in note for note in result["notes"])
    json.loads(json.dumps(result, allow_nan=False))


def test_classes_have_their_names_from_the_worst_to_the_best():
    names = "dangerous, not admissible, just admissible, satisfactory, good, very good"
    assert ", ".join(CLASSES) == names


def test_classes_begin_at_20_40_60_80():
    scores = [0, 19.99, 20, 39.99, 40, 59.99, 60, 79.99, 80, 100]
    names = [classify(score, 86400.0, 0.0, LONG)[0] for score in scores]
    assert [CLASSES.index(name) for name in names] == [1, 1, 2, 2, 3, 3, 4, 4, 5, 5]


@pytest.mark.parametrize(
    ("time", "share", "finding", "expected", "why"),
    [
        (5 * 3600, 0.0, None, "very good", "score"),
        (3 * 3600, 0.0, None, "satisfactory", "within the journey of 4 h"),
        (0.3 * 3600, 0.0, None, "not admissible", "within a tenth of the journey"),
        (5 * 3600, 0.06, None, "not admissible", "admissible 5 %"),
        (5 * 3600, 0.05, None, "very good", "score"),
        (5 * 3600, 0.51, None, "dangerous", "more than half"),
        (5 * 3600, 0.0, ("dangerous", "Y/Q 0.81"), "dangerous", "Y/Q 0.81"),
        (5 * 3600, 0.0, ("not admissible", "sum of guiding forces"), "not admissible", "sum of guiding forces"),
        (0.3 * 3600, 0.6, None, "dangerous", "more than half"),
    ],
)
def test_a_limit_that_lowers_the_class_is_named(time, share, finding, expected, why):
    name, reason = classify(90.0, time, share, LONG, findings=[finding] if finding else [])
    assert name == expected
    assert why in reason


def test_a_finding_lowers_the_class_of_a_ride():
    ratio = ("dangerous", "Y/Q 0.81 above 0.8")
    result = evaluate_ride(ride(), LONG, CLEARANCE, [ratio])
    assert (result["class"], result["decided_by"]) == ratio
    assert evaluate_ride(ride(), LONG, CLEARANCE)["class"] != "dangerous"


@pytest.mark.parametrize(
    ("time", "share", "reason"),
    [
        (4 * 3600, 0.0, "score 90.0"),  # a limit is exceeded beyond its value only
        (3 * 3600, 0.0, "reduced comfort after 3 h, within the journey of 4 h"),
        (0.4 * 3600, 0.0, "reduced comfort after 0.4 h, within the journey of 4 h"),
        (0.39 * 3600, 0.0, "reduced comfort after 0.39 h, within a tenth of the journey of 4 h"),
        (4 * 3600, 0.5, "flange contact for 50 % of the time, more than the admissible 5 %"),
        (4 * 3600, 0.51, "flange contact for 51 % of the time, more than half"),
    ],
)
def test_the_reason_for_a_class_is_the_limit_with_both_values(time, share, reason):
    assert classify(90.0, time, share, LONG)[1] == reason


@pytest.mark.parametrize(
    ("score", "parts", "use", "reason"),
    [
        (79.9, (0.8, 0.7), LONG, "score 79.9: comfort 0.80, guidance 0.70, the weaker is guidance"),
        (79.9, (0.7, 0.8), LONG, "score 79.9: comfort 0.70, guidance 0.80, the weaker is comfort"),
        (79.9, (0.8, 0.8), LONG, "score 79.9: comfort 0.80, guidance 0.80, the weaker is guidance"),
        (60.0, (0.7, 0.8), LONG, "score 60.0: comfort 0.70, guidance 0.80, the weaker is comfort"),
        (80.0, (0.7, 0.9), LONG, "score 80.0: comfort 0.70, guidance 0.90"),
        (50.0, (0.4, 0.6), GOODS, "score 50.0: load 0.40, guidance 0.60, the weaker is load"),
    ],
)
def test_the_reason_for_a_score_is_the_weaker_index(score, parts, use, reason):
    assert classify(score, 86400.0, 0.0, use, parts)[1] == reason


def test_goods_have_no_limit_of_comfort_time():
    assert classify(90.0, 60.0, 0.0, GOODS) == ("very good", "score 90.0")


def test_the_notes_say_why_values_are_missing_clipped_or_partial():
    partial = "n_mv: the lateral part only, EN 12299 adds the other axes"
    assert evaluate_ride(ride(flange_fractions=[0.0, 0.0]), LONG, CLEARANCE)["notes"] == [partial]
    bare = ride(weighted_acceleration_1974=50.0, sd_e=[0.0, 0.0])
    del bare["wz"], bare["block_rms"]
    result = evaluate_ride(bare, LONG, CLEARANCE)
    assert result["wz"] is None and result["comfort_hours"] == pytest.approx(1 / 60)
    assert result["notes"][:4] == [
        "comfort_hours: clipped to 1 min, the end of the table",
        "flange_margin: null, a wheelset does not move against the rails",
        f"n_mv: null, 0 blocks of 5 s are fewer than {MIN_BLOCKS}",
        "wz: null, no acceleration weighted with B",
    ]
    still = evaluate_ride(ride(weighted_acceleration_1974=0.0), LONG, CLEARANCE)
    assert still["notes"][0] == "comfort_hours: clipped to 24 h, the end of the table"
    few = evaluate_ride(ride(block_rms=[0.1, 0.1]), LONG, CLEARANCE)
    assert f"n_mv: null, 2 blocks of 5 s are fewer than {MIN_BLOCKS}" in few["notes"]


def test_contact_is_noted_from_more_than_ten_times_the_gaussian_share():
    gaussian = evaluate_ride(ride(), LONG, CLEARANCE)["flange_fraction_gaussian"]

    def is_noted(ratio):
        share = float(ratio * gaussian)
        notes = evaluate_ride(ride(flange_fractions=[share, 0.0]), LONG, CLEARANCE)["notes"]
        return any("flange_fraction_gaussian" in note for note in notes)

    assert [is_noted(ratio) for ratio in (9.9, 10.0, 10.5)] == [False, False, True]


def test_the_point_of_comfort_is_the_one_stated():
    assert evaluate_ride(ride(), LONG, CLEARANCE)["comfort_point"] == "frame centre through the floor transfer"
    above = evaluate_ride(ride(comfort_point="above the leading bogie"), LONG, CLEARANCE)
    assert above["comfort_point"] == "above the leading bogie"


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_one_part_alone_may_be_scored(weight):
    measures = score_many(ride(), SimpleNamespace(**(vars(LONG) | {"comfort_weight": weight})), CLEARANCE)
    assert measures["score"] == pytest.approx(100 * float(measures["comfort" if weight else "guidance"]))


@pytest.mark.parametrize("weight", [-0.01, 1.01])
def test_a_weight_beyond_0_and_1_is_refused(weight):
    with pytest.raises(ValueError, match=f"^comfort_weight must lie between 0 and 1: {weight:g}$"):
        score_many(ride(), SimpleNamespace(**(vars(LONG) | {"comfort_weight": weight})), CLEARANCE)


@pytest.mark.parametrize("clearance", [0.0, -0.001, math.nan])
def test_a_clearance_that_is_not_positive_is_refused(clearance):
    with pytest.raises(ValueError, match=f"^the flange clearance must be positive: {clearance:g} m$"):
        score_many(ride(), LONG, clearance)


def test_numbers_of_single_precision_are_scored_in_double_precision():
    single = {name: np.float32(values) for name, values in ride().items()}
    double = {name: np.float64(values) for name, values in single.items()}
    found, expected = score_many(single, LONG, CLEARANCE), score_many(double, LONG, CLEARANCE)
    assert all(found[name] == expected[name] and found[name].dtype == np.float64 for name in expected)


def test_blocks_of_single_precision_give_n_mv_in_double_precision():
    single = np.linspace(0.05, 0.2, 80, dtype=np.float32)
    found = evaluate_ride(ride(block_rms=single), LONG, CLEARANCE)["n_mv"]
    assert found == evaluate_ride(ride(block_rms=single.astype(np.float64)), LONG, CLEARANCE)["n_mv"]


def test_the_reason_for_the_score_of_a_ride_names_both_indices():
    result = evaluate_ride(ride(), LOCAL, CLEARANCE)
    measures = score_many(ride(), LOCAL, CLEARANCE)
    comfort, guidance = float(measures["comfort"]), float(measures["guidance"])
    assert result["decided_by"].startswith(
        f"score {result['score']:.1f}: comfort {comfort:.2f}, guidance {guidance:.2f}"
    )


def test_a_share_of_contact_far_above_the_gaussian_one_is_noted():
    """One bad place is counted, but hardly moves the standard deviation by which guidance is scored."""
    quiet = {"mean_e": [0.0, 0.0], "sd_e": [1e-3, 1e-3]}
    note = "e is not Gaussian"
    one_place = evaluate_ride(ride(**quiet, flange_fractions=[0.01, 0.0]), LONG, CLEARANCE)
    assert any(note in text for text in one_place["notes"])
    nowhere = evaluate_ride(ride(**quiet, flange_fractions=[0.0, 0.0]), LONG, CLEARANCE)
    assert not any(note in text for text in nowhere["notes"])


def test_a_limit_that_lowers_nothing_is_not_named():
    name, reason = classify(45.0, 3 * 3600, 0.0, LONG, parts=(0.2, 0.8))
    assert name == "satisfactory"
    assert reason == "score 45.0: comfort 0.20, guidance 0.80, the weaker is comfort"


def test_a_diverged_ride_is_dangerous_without_values():
    for lost in (ride(diverged=True), ride(sd_e=[np.nan, 1.0]), ride(weighted_acceleration=np.inf)):
        result = evaluate_ride(lost, LONG, CLEARANCE)
        assert (result["score"], result["class"]) == (0.0, "dangerous")
        assert result["comfort_hours"] is None and result["flange_margin"] is None
        assert set(result) == {*SCORE_KEYS, "notes"}
        json.loads(json.dumps(result, allow_nan=False))


def test_a_diverged_ride_says_so_and_keeps_its_point():
    result = evaluate_ride(ride(diverged=True, comfort_point="driver"), LONG, CLEARANCE)
    assert result["decided_by"] == "the vehicle left the track: motion beyond any bound"
    assert result["notes"] == ["no statistics: the ride diverged"] and result["comfort_point"] == "driver"


def test_of_many_rides_those_that_diverged_have_the_worst_measures():
    two = {name: np.stack([values, values]) for name, values in ride().items()}
    two["mean_e"][1], two["sd_e"][1] = np.inf, np.inf
    worst = {"score": 0, "comfort": 0, "guidance": 0, "comfort_hours": 1 / 60, "diverged": 1}
    worst |= {"weighted_acceleration": np.inf, "weighted_acceleration_1974": np.inf}
    worst |= {"flange_fraction": 1, "flange_fraction_gaussian": 1, "flange_margin": -np.inf}
    with np.errstate(all="raise", under="ignore"):
        measures = score_many(two | {"diverged": np.array([0.0, 0.0])}, LONG, CLEARANCE)
    assert {name: float(values[1]) for name, values in measures.items()} == pytest.approx(worst)
    alone = score_many(ride(), LONG, CLEARANCE)
    assert {name: float(values[0]) for name, values in measures.items()} == {k: float(v) for k, v in alone.items()}


def test_a_vehicle_without_motion_has_the_full_score_and_no_margin():
    still = ride(mean_e=[0.0, 0.0], sd_e=[0.0, 0.0], flange_fractions=[0.0, 0.0], wz=0.0)
    result = evaluate_ride(still | {"weighted_acceleration_1974": 0.0}, LONG, CLEARANCE)
    assert result["score"] == pytest.approx(100) and result["class"] == "very good"
    assert result["comfort_clipped"] is True and result["flange_margin"] is None
    assert any("24 h" in note for note in result["notes"])


def test_goods_are_scored_by_rms_and_peak_against_their_limits():
    assert float(goods_index(0.5, None, 2.0, None)) == pytest.approx(1 - 0.5 / 2)
    assert float(goods_index(0.5, 3.0, 2.0, 4.0)) == pytest.approx(1 - 3 / 4)
    assert float(goods_index(3.0, None, 2.0, None)) == 0.0
    goods = SimpleNamespace(**(vars(GOODS) | {"peak_limit": None}))
    passengers = evaluate_ride(ride(), LOCAL, CLEARANCE)
    load = evaluate_ride(ride(acceleration=0.5), goods, CLEARANCE)
    comfort = math.log(60 * passengers["comfort_hours"]) / math.log(1440)
    assert load["score"] - passengers["score"] == pytest.approx(100 * 0.4 * (0.75 - comfort))


def test_the_peak_of_goods_counts_where_a_limit_is_stated():
    measures = score_many(ride(acceleration=0.5, acceleration_peak=3.0), GOODS, CLEARANCE)
    assert measures["comfort"] == pytest.approx(1 - 3 / 4)
    with pytest.raises(ValueError, match="contain no peak"):
        score_many(ride(acceleration=0.5), GOODS, CLEARANCE)


def test_goods_may_be_scored_by_settings_that_know_no_peak():
    goods = SimpleNamespace(**{name: value for name, value in vars(GOODS).items() if name != "peak_limit"})
    measures = score_many(ride(acceleration=0.5, acceleration_peak=3.0), goods, CLEARANCE)
    assert measures["comfort"] == pytest.approx(1 - 0.5 / 2)


def test_goods_without_a_limit_are_rejected():
    text = r"^use: goods needs riding\.rms_limit \[m/s\^2\], which has no default, and the rms acceleration$"
    for statistics, use in ((ride(acceleration=0.5), vars(LOCAL) | {"use": "goods"}), (ride(), vars(GOODS))):
        with pytest.raises(ValueError, match=text):
            evaluate_ride(statistics, SimpleNamespace(**use), CLEARANCE)


def test_many_rides_at_once_are_the_same_as_one_after_the_other():
    rng = np.random.default_rng(0)
    many = {
        "mean_e": rng.normal(0, 1e-3, (20, 2)),
        "sd_e": rng.uniform(5e-4, 6e-3, (20, 2)),
        "flange_fractions": rng.uniform(0, 0.1, (20, 2)),
        "weighted_acceleration": rng.uniform(0, 1, 20),
        "weighted_acceleration_1974": rng.uniform(0, 1, 20),
        "diverged": np.arange(20) == 7,
    }
    result = score_many(many, LONG, CLEARANCE)
    assert all(not np.any(np.isnan(values)) for values in result.values())
    for i in range(20):
        alone = evaluate_ride({name: values[i] for name, values in many.items()}, LONG, CLEARANCE)
        assert result["score"][i] == alone["score"]
        if i != 7:
            assert result["flange_fraction"][i] == alone["flange_fraction"] == many["flange_fractions"][i].max()
            assert result["flange_margin"][i] == alone["flange_margin"]
            assert result["comfort_hours"][i] == alone["comfort_hours"]
    assert result["weighted_acceleration"][7] == np.inf and result["flange_margin"][7] == -np.inf


@given(st.floats(0, 2), st.floats(0, 2), st.floats(1e-5, 0.02), st.floats(1e-5, 0.02), st.floats(0, 1))
def test_less_acceleration_and_less_motion_never_lower_the_score(rms, other_rms, sd, other_sd, weight):
    use = SimpleNamespace(**(vars(LONG) | {"comfort_weight": weight}))

    def score(acceleration, deviation):
        statistics = ride(sd_e=[deviation, 1e-5], mean_e=[0, 0], weighted_acceleration_1974=acceleration)
        return evaluate_ride(statistics, use, CLEARANCE)["score"]

    better, worse = (
        score(min(rms, other_rms), min(sd, other_sd)),
        score(max(rms, other_rms), max(sd, other_sd)),
    )
    assert 0 <= worse <= better + 1e-9 <= 100 + 2e-9


@given(st.floats(1e-4, 1e-2), st.floats(1e-4, 1e-2), st.floats(-5e-3, 5e-3), st.floats(-5e-3, 5e-3))
def test_the_order_of_the_wheelsets_does_not_matter(sd1, sd2, m1, m2):
    forward = evaluate_ride(ride(mean_e=[m1, m2], sd_e=[sd1, sd2]), LONG, CLEARANCE)
    backward = evaluate_ride(ride(mean_e=[-m2, -m1], sd_e=[sd2, sd1]), LONG, CLEARANCE)
    for key in ("score", "flange_margin", "flange_fraction_gaussian"):
        assert forward[key] == backward[key]
