"""Guiding forces and load transfer: by hand from the motion, and as EN 14363 names them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.ride_quality.evaluation import ride
from railui.ride_quality.guiding_forces import GuidingForces, characteristic_values, instability_rms, sliding_mean
from railui.ride_quality.running_safety import running_safety, safety_of
from railui.ride_quality.safety_limits import SafetyLimits, flange_angle, force_limit, nadal_limit, weinstock_limit
from railui.track import Track
from railui.track.excitation import Excitation, resolve_track
from railui.vehicle.design_reader import load_design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

HOME = Path(__file__).parents[2]
COACH = Model(load_design(HOME / "designs/manchester_coach.yaml"))
BOGIE = Model(load_design(HOME / "designs/check_bogie.yaml"))
TRACK = "erri_b176_high length=400 seed=1"


def series(model: Model, channels: list[str], speed: float = 45.0) -> dict[str, np.ndarray]:
    road = Excitation(resolve_track(TRACK), speed)
    table = road.table(model.wheelset_spacing(), 1)
    result, lost = model.vehicles().simulate(model.single_batch(), table, road.dt, 1, channels)
    assert lost[0] == -1
    return dict(zip(channels, result[0], strict=True))


def test_the_limit_is_ten_kilonewtons_and_two_thirds_of_the_wheel_load() -> None:
    assert force_limit(60e3) == pytest.approx(50e3)


def test_a_sliding_mean_of_two_metres_flattens_what_is_shorter() -> None:
    s = np.arange(0.0, 40.0, 0.1)
    assert np.abs(sliding_mean(np.sin(2 * np.pi * s / 2.0), 0.1)).max() < 1e-12


def test_of_two_metre_means_what_all_but_fifteen_in_ten_thousand_keep_counts() -> None:
    assert characteristic_values(np.arange(10_001.0)) == pytest.approx(9985.0)


def guided(right: np.ndarray, left: np.ndarray, transferred: np.ndarray) -> GuidingForces:
    """The coach whose wheels press alike at all wheelsets, 400 samples a second, 0.1 m apart."""
    Y, dQ = np.tile([right, left], (4, 1)), np.tile(transferred, (4, 1))
    return GuidingForces.from_series(COACH, np.vstack([Y, dQ]), 400.0, 0.1)


def test_a_quotient_is_the_force_outwards_over_the_wheel_load_at_that_side() -> None:
    """Y outwards is Y at the right wheel and -Y at the left; dQ loads the right wheel and unloads the left."""
    even = np.ones(1000)
    result = guided(10e3 * even, -6e3 * even, 5e3 * even)
    assert result.total == pytest.approx(np.full((4, 981), 4e3), rel=1e-9)
    assert result.wheels[:, :, 500] == pytest.approx(np.tile([10e3, 6e3], (4, 1)), rel=1e-9)
    assert result.quotient[0, :, 500] == pytest.approx([10.0 / 59.546, 6.0 / 49.546], rel=1e-9)


def test_a_wheel_that_lifts_leaves_the_quotients_of_the_others() -> None:
    """The left wheels are wholly unloaded on the second half; the right ones carry twice their load there."""
    lifting = np.where(np.arange(2000) < 1000, 0.0, 1.1 * 54.546e3)
    even = np.ones(2000)
    result = guided(10e3 * even, -6e3 * even, lifting)
    assert np.isnan(result.quotient[0, 1, 1200:]).all() and np.isfinite(result.quotient[0, 1, :800]).all()
    assert result.quotient[0, 0, 1500] == pytest.approx(10.0 / 114.5466, rel=1e-3)
    assert result.quotient[0, 1, 500] == pytest.approx(6.0 / 54.546, rel=1e-3)
    safety = safety_of(COACH, result, 0.1 * np.arange(2000))
    assert ("dangerous", "a wheel lifts off the rail") in [(rank, why[:26]) for rank, why in safety.findings]
    assert safety.as_dict()["derailment_quotient"] == pytest.approx(10.0 / 54.546, rel=0.2)


def test_a_stretch_is_told_its_own_forces_and_how_much_of_it_lies_above_the_limit() -> None:
    half = np.where(np.arange(2000) < 1000, 60e3, 0.0)
    result = guided(half, 0 * half, 0 * half)
    whole, first, last = (
        result.between(first, stop, 2000).section_maxima() for first, stop in ((0, 2000), (0, 900), (1100, 2000))
    )
    assert whole["share_above_limit"] == pytest.approx(0.5, abs=0.02)
    assert first["share_above_limit"] == 1.0 and last["share_above_limit"] == 0.0
    assert first["sum_of_guiding_forces"] == pytest.approx(60e3, rel=0.02)
    assert first["derailment_quotient"] == pytest.approx(60.0 / 54.546, rel=0.02)
    assert last["sum_of_guiding_forces"] < 600.0


def test_instability_is_the_rms_of_what_swings_within_two_hertz_of_the_strongest() -> None:
    t = np.arange(8000) / 400.0
    swing = sum(a * np.sin(2 * np.pi * f * t) for a, f in ((5e3, 5.0), (4e3, 5.8), (3e3, 12.0)))  # 2 beats in 100 m
    result = instability_rms(swing, 400.0, 0.1)
    assert result["dominant_frequency"] == pytest.approx(5.0, abs=0.1)
    assert result["rms_100m"] == pytest.approx(np.hypot(5e3, 4e3) / np.sqrt(2.0), rel=0.03)


def test_guiding_forces_balance_what_accelerates_a_wheelset() -> None:
    """m y'' = -2 c_y d_1 - Y, (3.10)."""
    x = series(BOGIE, ["ay1", "d1", "Y1", "Y1.right", "Y1.left"], 40.0)
    values = BOGIE.design.values
    spring = 2.0 * values["vehicle.primary.lateral_stiffness"] * x["d1"]
    assert -(values["vehicle.wheelset.mass"] * x["ay1"] + spring) == pytest.approx(x["Y1"], abs=1e-6 * x["Y1"].std())
    assert x["Y1.right"] + x["Y1.left"] == pytest.approx(x["Y1"], abs=1e-6)


@pytest.mark.parametrize("name", ["manchester_coach", "bogie_under_coach"])
def test_guiding_forces_balance_what_accelerates_a_whole_vehicle(name: str) -> None:
    """The rails alone act on it from outside: the sum of m y'' over all bodies is that of -Y, in roll too."""
    model = Model(load_design(HOME / f"designs/{name}.yaml"))
    structure = model.design.structure
    assert structure is not None
    forces = [f"Y{w.number}" for w in structure.wheelsets]
    x = series(model, [*(f"ay.{body}" for body in structure.members), *forces])
    masses = {n: model.design.values[m.part.number_path("mass")] for n, m in structure.members.items()}
    inertia = sum(masses[n] * x[f"ay.{n}"] for n in structure.members)
    total = sum(x[channel] for channel in forces)
    assert -inertia == pytest.approx(total, abs=1e-9 * np.abs(total).max())
    assert x["Y1"].std() > 1e3


def test_at_rest_the_wheels_press_outwards_by_their_contact_angle_less_its_spin() -> None:
    """Y_1 = N delta + T_y1, T_y1 = kappa_s N u_n1, u_n1 = -delta/r (3.4), (3.5)."""
    x = series(Model(BOGIE.design), ["Y1.right", "Y1.left"], 40.0)
    known = 55e3 * 0.05 * (1.0 - 0.25 / 0.46)
    assert x["Y1.right"][0] == pytest.approx(known, rel=0.01)
    assert x["Y1.left"][0] == pytest.approx(-known, rel=0.01)


def test_load_transfer_bears_the_moments_of_all_bodies_about_the_track() -> None:
    """Steady roll: without acceleration the wheel loads balance the forces of springs and dampers on the wheelsets."""
    values = COACH.design.values
    freedoms = COACH.vehicles().degrees_of_freedom(COACH.single_batch())
    start = np.zeros((1, 34))
    start[0, freedoms.index("phi.frame_1")] = roll = 1e-3
    road = Excitation(resolve_track("erri_b176_low length=20 scale=1e-9"), 40.0)
    batch = COACH.single_batch().with_initial_states(start)
    result, _ = COACH.vehicles().simulate(
        batch, road.table(COACH.wheelset_spacing(), 1), road.dt, 1, ["dQ1", "dQ2", "dQ3"]
    )
    moment = 2 * values["vehicle.elements.primary.vertical_stiffness"] * roll  # y is 1 m
    lateral = 2 * values["vehicle.elements.primary.lateral_stiffness"] * roll * (0.46 - 0.6) * 0.46
    rates = COACH.vehicles().state_derivatives(COACH.single_batch(), road.table(COACH.wheelset_spacing(), 1)[0], start)[
        0
    ]
    inertia = values["vehicle.elements.wheelset.mass"] * 0.46 * rates[17 + freedoms.index("y.wheelset_1")]
    assert result[0, 0, 0] == pytest.approx((moment + lateral - inertia) / 1.5, rel=1e-6)
    assert result[0, 1, 0] == pytest.approx(result[0, 0, 0], rel=1e-6) and abs(result[0, 2, 0]) < 1e-6 * abs(
        result[0, 0, 0]
    )


def test_a_ride_tells_the_quantities_of_the_standard_by_name() -> None:
    result = ride(COACH, TRACK, 45.0)["forces"]
    assert result is not None and result["load_transfer"] and len(result["wheelsets"]) == 4
    one = result["wheelsets"][0]
    assert one["limit"] == pytest.approx(10e3 + 2 * 54.546e3 / 3)
    assert one["sum_of_guiding_forces"] > 0 and 0 <= one["share_above_limit"] <= 1
    assert one["rms_100m"] > 0 and 0.4 <= one["dominant_frequency"] < 20
    assert result["derailment_quotient"] == max(q for w in result["wheelsets"] for q in w["derailment_quotient"])


def test_a_planar_bogie_has_its_static_wheel_load_and_says_so() -> None:
    safety = running_safety(BOGIE, Excitation(resolve_track(TRACK), 40.0))
    assert safety is not None
    result = safety.as_dict()
    assert not result["load_transfer"] and "planar" in result["notes"][0]
    one = result["wheelsets"][0]
    assert one["derailment_quotient"] == pytest.approx(np.array(one["guiding_force"]) / 55e3)


def test_guiding_forces_may_stand_for_flange_contact_in_the_score() -> None:
    model = Model(COACH.design.with_values({"riding.guidance": "lateral_force"}))
    result = ride(model, TRACK, 45.0)
    Y = series(model, ["Y1", "Y2", "Y3", "Y4"])
    shares = [float(np.mean(np.abs(y) >= force_limit(54.546e3))) for y in Y.values()]
    assert result["flange_fractions"] == pytest.approx(shares, abs=1e-12)
    assert any("guiding forces" in note for note in result["notes"])


def kinked(amplitude: float, length: float = 1000.0) -> Track:
    """A straight track with one lateral bump of 10 m in its middle."""
    s = np.arange(0.0, length, 0.1)
    x = (s - 0.5 * length) / 10.0
    return Track(s, np.where(np.abs(x) < 0.5, 0.5 * amplitude * (1 + np.cos(2 * np.pi * x)), 0.0))


def test_a_ride_over_the_limit_of_y_over_q_is_dangerous() -> None:
    """Its score is that of a very good ride: comfort and flange contact do not show one bad place."""
    result = ride(HOME / "designs/bogie_under_coach.yaml", kinked(0.04), 45.0)
    assert result["score"] > 80 and result["class"] == "dangerous"
    assert result["decided_by"].startswith("Y/Q 1.27 over 2 m, more than 0.8 (wheelset 1, right wheel, at 50")
    assert result["safety_share"] > 1.5
    assert ride(HOME / "designs/bogie_under_coach.yaml", kinked(0.008), 45.0)["class"] == "very good"


def test_a_place_is_judged_however_long_the_ride_is() -> None:
    """A percentile of the whole ride would let it vanish: 0.15 % of 4 km are 6 m."""
    short, long = (ride(HOME / "designs/bogie_under_coach.yaml", kinked(0.04, x), 45.0) for x in (1000.0, 4000.0))
    largest = "largest_derailment_quotient"
    assert long["forces"]["derailment_quotient"] < 0.6 < 1.2 < long[largest] == pytest.approx(short[largest], rel=1e-3)
    assert long["class"] == "dangerous"


def test_a_lifted_wheel_is_dangerous_and_the_other_wheels_keep_their_quotient() -> None:
    result = ride(HOME / "designs/bogie_under_coach.yaml", kinked(0.04), 60.0)
    assert result["class"] == "dangerous" and result["forces"]["derailment_quotient"] > 0.5
    assert "wheel_lift" in [each["criterion"] for each in result["forces"]["criteria"] if each["exceeded"]]
    assert result["largest_wheel_unloading"] > 1.0


def test_each_limit_is_compared_with_its_own_quantity() -> None:
    """Made forces of 60 kN against 46.4, 0.35 of Q_0 unloaded; the rms of a swing of 5 Hz against half of 46.4 kN."""
    n, t = 4000, np.arange(4000) / 400.0
    even, s = np.ones(n), 0.1 * np.arange(4000)
    swing = 40e3 * np.sin(2 * np.pi * 5.0 * t)
    safety = safety_of(COACH, guided(60e3 * even + swing, 0.0 * even, -0.7 * 54.546e3 * even), s)
    found = {each.key: each for each in safety.criteria}
    limit = 10e3 + 2 * 54.546e3 / 3
    assert found["sum_of_guiding_forces"].limit == pytest.approx(limit)
    assert found["rms_100m"].limit == pytest.approx(limit / 2)
    assert found["rms_100m"].value == pytest.approx(40e3 / np.sqrt(2.0), rel=0.03)
    assert found["wheel_unloading"].value == pytest.approx(0.7, rel=1e-3)
    assert found["derailment_quotient"].value > 60.0 / (0.3 * 54.546)
    assert {each.key for each in safety.criteria if each.is_exceeded} >= {"rms_100m", "wheel_unloading"}


def test_instability_is_located_where_the_wheelset_nearest_its_limit_swings() -> None:
    """The first wheelset swings at 100 m near its limit, the second at 300 m with more, far below a higher limit."""
    s = 0.1 * np.arange(4000)
    centres = np.array([1000, 3000])
    even = np.ones(4000)
    made = guided(even, 0.0 * even, 0.0 * even)
    rms = np.array([[20e3, 0.0], [0.0, 30e3], [0.0, 0.0], [0.0, 0.0]])
    forces = replace(made, rms=rms, centres=centres, limit=np.array([30e3, 90e3, 90e3, 90e3]))
    found = {each.key: each for each in safety_of(COACH, forces, s).criteria}["rms_100m"]
    assert (found.place, found.at, found.value) == ("wheelset 1", pytest.approx(100.0), 20e3)


def test_the_flange_angle_and_friction_of_a_design_make_its_limits() -> None:
    """S1002 has 70 degrees; friction 0.35 gives Nadal 1.221, friction 0.7 gives 0.700."""
    design = load_design(HOME / "designs/profiled_bogie.yaml")
    limits = SafetyLimits.of(Model(design))
    assert limits.flange_angle == pytest.approx(np.radians(70.0), abs=np.radians(0.2))
    assert limits.nadal == pytest.approx(1.221, abs=0.01) and limits.quotient == 0.8
    assert limits.weinstock == pytest.approx(limits.nadal + 0.35)
    slippery = SafetyLimits.of(Model(design.with_values({"effects.0.friction": 0.7})))
    assert slippery.quotient == slippery.nadal == pytest.approx(0.700, abs=0.01)


def test_a_flange_with_friction_makes_the_limits_of_a_design_without_profiles() -> None:
    """Friction 0.2 at 60 degrees: (1.73205 - 0.2)/(1 + 0.34641) = 1.13787; the tread has 0.35."""
    rubbing = {"clearance": 7e-3, "stiffness": 14.6e6, "friction": 0.2, "angle": np.radians(60.0)}
    flange = PlacedEffect("flange_contact", "contact", None, rubbing)
    creep = PlacedEffect("creep_saturation", "contact", None, {"friction": 0.35})
    limits = SafetyLimits.of(Model(load_design(HOME / "designs/check_bogie.yaml").with_effects([creep, flange])))
    assert limits.nadal == pytest.approx(1.13787, abs=1e-5) and limits.quotient == 0.8
    assert (limits.friction, limits.has_flange) == (0.2, True)


def test_nadal_and_weinstock_by_hand() -> None:
    """tan 60 = 1.73205: (1.73205 - 0.4)/(1 + 0.69282) = 0.78688."""
    assert nadal_limit(np.radians(60.0), 0.4) == pytest.approx(0.78688, abs=1e-5)
    assert weinstock_limit(np.radians(60.0), 0.4) == pytest.approx(1.18688, abs=1e-5)


def test_the_noise_of_a_profile_is_no_flange_angle() -> None:
    y = np.linspace(-0.05, 0.0, 2001)
    slope = np.interp(y, [-0.05, -0.045, -0.035, -0.03], [0.0, np.tan(np.radians(65.0)), np.tan(np.radians(65.0)), 0.0])
    h = np.cumsum(slope) * (y[1] - y[0]) + 5e-6 * np.random.default_rng(1).normal(size=y.size)
    assert np.degrees(flange_angle(y, h)) == pytest.approx(65.0, abs=1.0)


def test_what_a_design_without_flange_or_friction_cannot_show_is_noted() -> None:
    linear, full = (
        " ".join(ride(HOME / f"designs/{name}.yaml", TRACK, 40.0)["forces"]["notes"])
        for name in ("check_bogie", "profiled_bogie")
    )
    assert "no flange_contact" in linear and "without bound" in linear and "planar" in linear
    assert "no flange_contact" not in full and "without bound" not in full
