"""Ride quality on a track: statistics of simulated series, independence of the batch."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

from railui.bench.standard_job import bogie_model
from railui.dsp.discretise import discretise
from railui.io.problems import FileProblems
from railui.ride_quality.comfort import comfort_point_transfer, fixed_transfer_note
from railui.ride_quality.evaluation import excitation_of, ride, ride_many, simulate, simulate_rides
from railui.ride_quality.statistics import ride_statistics
from railui.ride_quality.weighting import W_D, cascade, comfort_cascades, weighted_rms
from railui.track import Track
from railui.track.excitation import Excitation, resolve_track
from railui.track.reader import save_track
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.model import Model

HOME = Path(__file__).parents[2]
BOGIE = load_design(HOME / "designs/test_bogie.yaml")
CHECK = load_design(HOME / "designs/check_bogie.yaml")
LOW = "erri_b176_low length=400 seed=1"
CREEP = {"kind": "creep_saturation", "at": "contact", "friction": 0.35}


def with_effects(*entries: dict[str, Any], base: Design = BOGIE) -> Design:
    text = "".join(f"\n  - {{{', '.join(f'{k}: {v}' for k, v in entry.items())}}}" for entry in entries)
    source = (HOME / f"designs/{'test' if base is BOGIE else 'check'}_bogie.yaml").read_text("utf-8")
    return load_design(f"{source}\neffects:{text}\n")


def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Equal to the last digit, but for what only a single ride has."""
    own = {"reference": None}
    return {**one, **own} == {**other, **own}


def test_displacement_statistics_are_those_of_the_series() -> None:
    tight = BOGIE.with_values({"contact.flange_clearance": 2e-3})
    series = simulate(tight, LOW, 40.0, ["e1", "e2"])
    result = ride(tight, LOW, 40.0)
    e = np.array([series["e1"], series["e2"]])
    assert result["statistics"]["mean_e"] == pytest.approx(e.mean(axis=1), rel=1e-6, abs=1e-12)
    assert result["statistics"]["sd_e"] == pytest.approx(e.std(axis=1), rel=1e-9)
    assert result["flange_fractions"] == pytest.approx((np.abs(e) >= 2e-3).mean(axis=1), abs=1e-12)
    assert 0 < result["flange_fraction"] == max(result["flange_fractions"])


def test_weighted_accelerations_are_those_of_the_filtered_series() -> None:
    x = simulate(BOGIE, LOW, 40.0, ["ayf"])["ayf"]
    result = ride(BOGIE, LOW, 40.0)
    for name, sections in comfort_cascades(BOGIE.riding, 0.0025).items():
        rms = float(np.sqrt(np.mean(signal.sosfilt(sections.copy(), x) ** 2)))
        expected = 4.42 * rms**0.3 if name == "wz" else rms
        assert result[name] == pytest.approx(expected, rel=1e-9), name


def test_the_reference_weighs_in_the_frequency_domain() -> None:
    x = simulate(BOGIE, LOW, 40.0, ["ayf"])["ayf"]
    point = comfort_point_transfer(BOGIE.riding)
    result = ride(BOGIE, LOW, 40.0)["reference"]
    wd = weighted_rms(x, 0.0025, cascade(point, W_D))
    assert result["weighted_acceleration"] == pytest.approx(wd, rel=1e-12)


def test_streaming_and_reference_agree_within_three_per_cent() -> None:
    result = ride(BOGIE, "erri_b176_low length=2000 seed=1", 40.0)
    for key, value in result["reference"].items():
        assert result[key] == pytest.approx(value, rel=0.03), key


def test_blocks_of_five_seconds_give_n_mv_from_five_minutes_on() -> None:
    track, dt = "erri_b176_low length=9100 seed=1 spacing=0.2", 0.2 / 30.0
    sections = comfort_cascades(BOGIE.riding, dt)["weighted_acceleration"]
    felt = signal.sosfilt(sections.copy(), simulate(BOGIE, track, 30.0, ["ayf"])["ayf"])
    blocks = [np.sqrt(np.mean(felt[k : k + 750] ** 2)) for k in range(0, len(felt) - 749, 750)]
    assert ride(BOGIE, track, 30.0)["n_mv"] == pytest.approx(6 * np.percentile(blocks, 95), rel=1e-9)
    assert ride(BOGIE, LOW, 40.0)["n_mv"] is None


def all_same(found: list[dict[str, Any]], expected: list[dict[str, Any]]) -> bool:
    return all(same(one, other) for one, other in zip(found, expected, strict=True))


def company() -> list[Design]:
    """Twenty-three designs of two structures, two wheelbases and two uses."""
    rng = np.random.default_rng(1)
    result = []
    for i in range(23):
        base = with_effects(CREEP) if i % 3 == 0 else BOGIE
        changes: dict[str, Any] = {"vehicle.primary.lateral_stiffness": float(rng.uniform(2e6, 5e6))}
        if i % 4 == 0:
            changes["vehicle.geometry.half_wheelbase"] = 1.1
        if i % 5 == 0:
            changes["riding.use"] = "local"
        result.append(base.with_values(changes))
    return result


def test_results_do_not_depend_on_the_batch_or_the_number_of_threads() -> None:
    designs = company()
    road = excitation_of(LOW, 40.0)
    alone = [simulate_rides([Model(design)], road, 1)[0] for design in designs]
    for jobs in (1, 2):
        assert all_same(ride_many(designs, LOW, 40.0, jobs), alone)
    backwards = ride_many(designs[::-1], LOW, 40.0)[::-1]
    assert all_same(backwards, alone)
    assert same(ride(designs[0], LOW, 40.0), alone[0])


def test_a_stiff_design_does_not_change_the_steps_of_others() -> None:
    stiff = BOGIE.with_values({"vehicle.primary.lateral_stiffness": 3e8})
    result = ride_many([BOGIE, stiff, BOGIE], LOW, 40.0)
    assert result[1]["steps"] > result[0]["steps"] == result[2]["steps"] == 1
    assert same(result[0], result[2]) and same(result[1], ride(stiff, LOW, 40.0))


def test_a_diverging_vehicle_is_dangerous_with_its_location() -> None:
    result = ride(CHECK, "erri_b176_high length=1000 seed=1", 80.0)
    assert result["class"] == "dangerous" and result["score"] == 0.0
    assert 0 < result["diverged"]["at_s"] < 1000
    assert result["weighted_acceleration"] is None and result["reference"] is None
    assert any("diverged" in note for note in result["notes"])
    series = simulate(CHECK, "erri_b176_high length=1000 seed=1", 80.0)
    assert np.isnan(series["e1"][-1]) and np.isfinite(series["e1"][0])


def test_a_note_reports_a_motion_that_steps_do_not_resolve() -> None:
    text = {"kind": "bump_stop", "at": "primary_lateral", "gap": 5e-4}
    hard, soft = (ride(with_effects(text | {"stiffness": k}), "erri_b176_high length=300", 40.0) for k in (1e9, 1e5))
    assert any("steps: " in note and "instead of" in note for note in hard["notes"])
    assert not any("steps: " in note for note in soft["notes"])


@pytest.mark.parametrize("speed", [5.0, 20.0, 60.0, 90.0, 120.0])
def test_score_statistics_are_exact_to_1e_4_at_any_speed(speed: float) -> None:
    model, road = bogie_model(), excitation_of("erri_b176_high length=300 seed=1", speed)
    taken = model.vehicles().required_steps(model.single_batch(), speed, speed, road.dt)[0]
    result, exact = (ride_statistics(model, model.row[None], road, steps=np.array([n])) for n in (taken, 16 * taken))
    for key in ("mean_e", "sd_e", "weighted_acceleration", "weighted_acceleration_1974"):
        scale = np.hypot(exact["mean_e"], exact["sd_e"]) if key.endswith("_e") else exact[key]
        assert np.max(np.abs(result[key] - exact[key]) / scale) < 1e-4


def test_a_track_is_the_same_as_a_spec_an_object_and_a_file(tmp_path: Path) -> None:
    source = resolve_track(LOW)
    file = save_track(tmp_path / "line.csv", *(getattr(source.track, q) for q in ("s", "yw", "phiw", "gauge")))
    spec, track, table = (ride(BOGIE, given, 40.0) for given in (LOW, source.track, file))
    assert track["score"] == spec["score"]
    assert table["score"] == pytest.approx(spec["score"], rel=1e-5)  # 400 m have a mean line of a micrometre
    assert (spec["seed"], track["seed"], table["track"]) == (1, None, "line.csv")


def test_a_run_is_a_track_of_its_longest_segment() -> None:
    result = ride(BOGIE, HOME / "designs/campaigns/worn_axle_box/run_a.csv.gz", 40.0)
    assert any("longest segment" in note for note in result["notes"])
    assert 0.4 < result["weighted_acceleration"] / ride(BOGIE, LOW, 40.0)["weighted_acceleration"] < 2.5


def test_a_speed_may_carry_its_unit() -> None:
    assert ride(BOGIE, LOW, "144 km/h") == ride(BOGIE, LOW, 40.0)


@pytest.mark.parametrize("speed", [0.0, -1.0, np.inf, np.nan])
def test_an_invalid_speed_is_rejected(speed: float) -> None:
    with pytest.raises(ValueError, match="speed must be positive"):
        ride(BOGIE, LOW, speed)


def test_a_seed_replaces_that_of_the_spec() -> None:
    assert same(ride(BOGIE, LOW, 40.0, seed=7), ride(BOGIE, LOW.replace("seed=1", "seed=7"), 40.0))
    with pytest.raises(ValueError, match="no seed"):
        ride(BOGIE, resolve_track(LOW).track, 40.0, seed=2)


def test_a_rig_cannot_run_on_a_track() -> None:
    with pytest.raises(FileProblems, match="rides no track"):
        ride(load_design("vehicle: {rig: {mass: 95}}"), LOW, 40.0)


def test_gauge_widens_the_clearance_only_if_requested() -> None:
    source = resolve_track(LOW)
    gauge = 4e-3 * np.sin(2 * np.pi * source.track.s / 37)
    track = Track(source.track.s, source.track.yw, source.track.phiw, gauge)
    tight = BOGIE.with_values({"contact.flange_clearance": 2e-3})
    widened = tight.with_values({"contact.gauge_widens_clearance": True})
    e1 = simulate(tight, track, 40.0, ["e1"])["e1"]
    assert ride(tight, track, 40.0)["flange_fractions"][0] == pytest.approx((np.abs(e1) >= 2e-3).mean())
    result = ride(widened, track, 40.0)
    assert result["flange_fractions"][0] == pytest.approx((np.abs(e1) >= 2e-3 + gauge / 2).mean())
    assert result["statistics"]["sd_e"][0] == pytest.approx(np.sqrt(e1.var() + (gauge / 2).var()))


def test_goods_are_scored_by_rms_and_peak_at_the_load() -> None:
    limits = {"riding.use": "goods", "riding.rms_limit": 1.0, "riding.peak_limit": 5.0}
    goods = BOGIE.with_values(limits)
    x = simulate(goods, LOW, 40.0, ["ayf"])["ayf"]
    felt = signal.sosfilt(discretise(comfort_point_transfer(goods.riding), 0.0025), x)
    model = Model(goods)
    result = ride_statistics(model, model.row[None], excitation_of(LOW, 40.0))
    assert result["acceleration"][0] == pytest.approx(np.sqrt(np.mean(felt**2)), rel=1e-9)
    assert result["acceleration_peak"][0] == pytest.approx(np.abs(felt).max(), rel=1e-9)
    assert ride(goods, LOW, 40.0)["decided_by"].startswith("score")
    with pytest.raises(FileProblems, match="rms_limit"):
        ride(BOGIE.with_values({"riding.use": "goods"}), LOW, 40.0)


def test_comfort_without_a_carbody_is_noted() -> None:
    (note,) = (note for note in ride(BOGIE, LOW, 40.0)["notes"] if "fixed transfer" in note)
    assert "(1.2 Hz, damping 0.2), which does not follow the secondary suspension" in note
    for name, is_noted in (("cooperrider", True), ("manchester_coach", False)):
        design = load_design(HOME / f"designs/{name}.yaml")
        assert (fixed_transfer_note(design) is not None) == is_noted


def test_a_stronger_secondary_damper_seems_to_give_comfort_without_a_carbody() -> None:
    """The figures of docs/limits.md: a damper of 60 instead of 15 kN s/m, with and without a carbody of 15 t."""
    track, path = "erri_b176_low length=2000", "vehicle.secondary.lateral_damping"
    coach = {"kind": "coach_mode", "at": "secondary_lateral", "mass": 15e3, "stiffness": 2e5}
    pairs = {
        0.99: [BOGIE.with_values({path: damping}) for damping in (15e3, 60e3)],
        1.6: [with_effects(coach | {"damping": damping}) for damping in (15e3, 60e3)],
    }
    for ratio, designs in pairs.items():
        weak, strong = (ride(design, track, 40.0)["weighted_acceleration"] for design in designs)
        assert strong / weak == pytest.approx(ratio, abs=0.01)


def test_a_modelled_carbody_is_the_comfort_point() -> None:
    coach = {"kind": "coach_mode", "at": "secondary_lateral", "mass": 12e3, "stiffness": 3e5, "damping": 3e4}
    design = with_effects(coach)
    series = simulate(design, LOW, 40.0, ["z.frame.0", "z.secondary_lateral.0"])
    y_coach = series["z.frame.0"] - series["z.secondary_lateral.0"]
    felt = signal.sosfilt(discretise(W_D, 0.0025), np.gradient(np.gradient(y_coach, 0.0025), 0.0025))
    result = ride(design, LOW, 40.0)
    assert result["comfort_point"].startswith("carbody")
    assert not any("fixed transfer" in note for note in result["notes"])
    assert result["weighted_acceleration"] == pytest.approx(np.sqrt(np.mean(felt**2)), rel=2e-3)


def test_an_excitation_caches_a_limited_number_of_tables() -> None:
    excitation = Excitation(resolve_track("erri_b176_low length=200"), 40.0)
    tables = [excitation.table(float(a), 1) for a in np.linspace(1.0, 1.5, 12)]
    assert excitation.table(1.5, 1) is tables[-1]
    assert excitation.table(1.0, 1) is not tables[0]


def test_a_renamed_design_is_the_same_vehicle() -> None:
    assert same(ride(replace(BOGIE, name="other"), LOW, 40.0), ride(BOGIE, LOW, 40.0))


def test_the_end_of_a_record_does_not_run_into_its_start() -> None:
    """A record that ends with a decaying swing: periodic continuation would lay it on the quiet start."""
    t = np.arange(1000) / 400.0
    x = np.where(t < 2.3, 0.01, 1.0) * np.sin(2 * np.pi * 2.0 * t) + 0.5 * (t > 2.4)
    streamed = signal.sosfilt(discretise(W_D, 1 / 400.0), x)
    assert weighted_rms(x, 1 / 400.0, W_D) == pytest.approx(float(np.sqrt(np.mean(streamed**2))), rel=0.01)


def test_the_flange_moves_with_half_the_gauge() -> None:
    flanged = with_effects({"kind": "flange_contact", "at": "contact"})
    drawn = resolve_track("erri_b176_high length=600 seed=1").track
    line, wider = (Track(drawn.s, drawn.yw, drawn.phiw, np.full(len(drawn), gauge)) for gauge in (0.0, 10e-3))
    with_setting = {"contact.gauge_widens_clearance": True, "contact.flange_clearance": 3e-3}
    channels = ["e1", "e2", "ay1", "Y1"]
    moved = simulate(flanged.with_values(with_setting), wider, 50.0, channels)
    by_hand = simulate(flanged.with_values({"contact.flange_clearance": 8e-3}), wider, 50.0, channels)
    at_rest = simulate(flanged.with_values({"contact.flange_clearance": 3e-3}), wider, 50.0, channels)
    plain = simulate(flanged.with_values({"contact.flange_clearance": 3e-3}), line, 50.0, channels)
    for c in channels:
        assert moved[c] == pytest.approx(by_hand[c], rel=1e-6, abs=1e-6 * np.abs(by_hand[c]).max())
        assert np.array_equal(at_rest[c], plain[c])
        assert np.abs(moved[c] - at_rest[c]).max() > 0.01 * np.abs(at_rest[c]).max()
    assert np.abs(moved["e1"]).max() > 8e-3
    counted = ride(flanged.with_values(with_setting), wider, 50.0)["flange_fractions"][0]
    assert counted == pytest.approx((np.abs(moved["e1"]) >= 8e-3).mean())


def test_a_gauge_that_closes_the_clearance_leaves_a_spring_without_play() -> None:
    flanged = with_effects({"kind": "flange_contact", "at": "contact", "stiffness": 1e6})
    setting = {"contact.gauge_widens_clearance": True, "contact.flange_clearance": 3e-3}
    line = resolve_track(LOW).track
    narrow = Track(line.s, line.yw, line.phiw, np.full(len(line), -8e-3))
    closed = simulate(flanged.with_values(setting), narrow, 40.0, ["e1"])["e1"]
    spring = flanged.with_values({"contact.flange_clearance": 1e-9})
    assert closed == pytest.approx(simulate(spring, line, 40.0, ["e1"])["e1"], abs=1e-7)


DATUM_CHANNELS = ("e1", "e2", "ay1", "ayf", "Y1.right", "Y2.left")
DATUM_DESIGNS = ("check_bogie", "test_bogie", "profiled_bogie", "cooperrider", "manchester_coach")


@pytest.mark.parametrize("design", DATUM_DESIGNS)
@pytest.mark.parametrize(("offset", "heading"), [(1.0, 0.0), (0.0, 5e-3), (-0.3, 2e-3)])
def test_a_track_shifted_or_turned_as_a_whole_is_the_same(design: str, offset: float, heading: float) -> None:
    line = resolve_track(LOW).track
    plain = Track(line.s, line.yw, line.phiw, line.gauge)
    moved = Track(line.s, line.yw + offset + heading * line.s, line.phiw, line.gauge)
    path = HOME / f"designs/{design}.yaml"
    near, far = (simulate(path, track, 40.0, DATUM_CHANNELS) for track in (plain, moved))
    for channel in DATUM_CHANNELS:
        np.testing.assert_allclose(far[channel], near[channel], rtol=0, atol=1e-9 * np.abs(near[channel]).max())
    rides = [ride(path, track, 40.0) for track in (plain, moved)]
    assert rides[1]["class"] == rides[0]["class"]
    for key in ("score", "safety_share", "weighted_acceleration"):
        assert rides[1][key] == pytest.approx(rides[0][key], rel=1e-9)
    assert rides[1]["statistics"] == {
        key: pytest.approx(value, rel=1e-9) for key, value in rides[0]["statistics"].items()
    }


def test_a_ride_starts_on_the_rails() -> None:
    rise = np.zeros(1000)
    rise[:500] = 0.02 * np.cos(np.linspace(0.0, np.pi / 2, 500)) ** 2
    series = simulate(BOGIE, Track(0.1 * np.arange(1000.0), rise), 20.0, ["e1", "e2", "state.0"])
    assert abs(series["e1"][0]) < 1e-15 and abs(series["e2"][0]) < 1e-15
    assert abs(series["state.0"][0]) > 1e-3
