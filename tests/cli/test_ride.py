"""railui ride: cases, statistics, overrides, usage errors."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tests.cli.runner import BOGIE, ROOT, TRACK, document, run, run_ride


def test_a_ride_has_its_documented_keys() -> None:
    found = document(run_ride("--speed", "40", "--json", "-"))
    assert set(found) >= {
        *("score", "class", "decided_by", "comfort_hours", "comfort_clipped", "comfort_point"),
        *("weighted_acceleration", "weighted_acceleration_1974", "flange_fraction", "flange_fractions"),
        *("flange_fraction_gaussian", "flange_margin", "n_mv", "wz"),
    }


def test_several_speeds_and_seeds_are_cases_with_mean_and_standard_deviation() -> None:
    found = document(run_ride("--speeds", "30:40:10", "--seeds", "1:3", "--json", "-"))
    assert [(c["speed"], c["seed"]) for c in found["cases"]] == [
        *((30.0, 1), (40.0, 1), (30.0, 2)),
        *((40.0, 2), (30.0, 3), (40.0, 3)),
    ]
    scores = [case["score"] for case in found["cases"]]
    mean = sum(scores) / 6
    assert found["mean"]["score"] == pytest.approx(mean)
    assert found["sd"]["score"] == pytest.approx(math.sqrt(sum((s - mean) ** 2 for s in scores) / 5))
    assert len(found["mean"]["flange_fractions"]) == 2


def test_a_diverged_case_makes_the_mean_null_and_is_noted() -> None:
    words = ("ride", str(ROOT / "designs/check_bogie.yaml"), "--track", "erri_b176_high length=800")
    found = document(run(*words, "--speeds", "30,80", "--json", "-"))
    assert found["cases"][1]["class"] == "dangerous" and found["mean"]["comfort_hours"] is None
    assert found["notes"][0].endswith("1 of 2 diverged")
    assert run(*words, "--speed", "80", "--strict").exit_code == 4
    assert run(*words, "--speed", "80").exit_code == 0


def test_an_override_has_the_effect_of_a_value_in_the_file() -> None:
    from railui import load, ride

    path = "vehicle.primary.lateral_stiffness"
    found = document(run_ride("--speed", "144 km/h", f"{path}=4 MN/m", "--json", "-"))
    assert found["overrides"] == {path: "4 MN/m"}
    assert found["score"] == ride(load(BOGIE).with_values({path: 4e6}), TRACK, 40.0)["score"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--speed", "144"), "write 144 km/h"),
        (("--speed", "40 m"), "a unit like m/s is expected"),
        (("--speed", "0"), "give more than 0 m/s"),
        (("--speeds", "60:30"), "runs backwards"),
        (("--speed", "40", "--speeds", "30,40"), "give either --speed or --speeds"),
        ((), "give either --speed or --speeds"),
        (("--speeds", "30", "--seeds", "1,x"), "is not a seed"),
        (
            ("--speed", "40", "vehicle.primary.lateral_stifness=4e6"),
            "did you mean 'vehicle.primary.lateral_stiffness'?",
        ),
        (("--speed", "40", "vehicle.primary.lateral_stiffness=4 kg"), "a unit like N/m is expected"),
        (("--speed", "40", "stiff"), "write PATH=VALUE"),
        (("--speed", "40", "--track", "erri_b176_lo"), "did you mean erri_b176_low?"),
        (("--speed", "40", "--track", "no.csv"), "no.csv: cannot be read"),
        (("--speed", "40", "--track", f"{TRACK} lenght=3"), "did you mean length?"),
    ],
)
def test_a_usage_error_names_its_remedy_and_has_exit_code_2(words: tuple[str, ...], message: str) -> None:
    result = run_ride(*words)
    assert result.exit_code == 2 and result.stdout == ""
    assert message in " ".join(result.stderr.split())


def test_a_vehicle_too_stiff_to_integrate_has_exit_code_1() -> None:
    result = run_ride("--speed", "0.01 m/s")
    assert result.exit_code == 1
    assert result.stderr.startswith("railui: ")


def test_a_track_file_has_no_seeds(tmp_path: Path) -> None:
    file = str(tmp_path / "line.csv")
    assert run("track", *TRACK.split(), "-o", file).exit_code == 0
    words = ("ride", BOGIE, "--track", file, "--speed", "40")
    assert document(run(*words, "--json", "-"))["seed"] is None  # nothing was random
    for option in (["--seeds", "1,2"], ["--seed", "5"]):
        refused = run(*words, *option)
        assert refused.exit_code == 2 and "it has no seed, leave out --seed" in refused.stderr


def test_several_speeds_report_the_worst_with_its_limits_of_running_safety(tmp_path: Path) -> None:
    s = [0.1 * i for i in range(8000)]
    rows = (f"{x:.1f},{0.02 * (1 + math.cos(2 * math.pi * (x - 400) / 10)) if abs(x - 400) < 5 else 0.0}" for x in s)
    (tmp_path / "kink.csv").write_text("s [m],yw [m]\n" + "\n".join(rows) + "\n")
    words = ("ride", str(ROOT / "designs/bogie_under_coach.yaml"), "--track", str(tmp_path / "kink.csv"))
    found = document(run(*words, "--speeds", "20,45", "--json", "-"))
    assert [case["class"] for case in found["cases"]][1] == "dangerous" == found["worst"]["class"]
    assert found["worst"]["speed"] == 45.0 and found["worst"]["decided_by"].startswith("Y/Q 1.27")
    assert found["worst"]["safety_share"] == max(case["safety_share"] for case in found["cases"])
    assert found["cases"][1]["forces"]["criteria"]
    assert run(*words, "--speeds", "20,45", "--strict").exit_code == 4
    single = run(*words, "--speed", "45", "--strict")
    assert single.exit_code == 4 and "1.27 of 0.8, exceeded" in single.output


def test_a_ride_of_half_a_second_is_not_very_good() -> None:
    words = ("ride", BOGIE, "--track", "erri_b176_low length=20", "--speed", "40", "--json", "-")
    found = document(run(*words))
    assert found["class"] == "satisfactory" and found["decided_by"].startswith("a ride of 0.5 s only")
    assert any("take 20 s or more" in note for note in found["notes"])


def test_an_override_of_a_number_that_a_coach_mode_replaces_is_warned_of(tmp_path: Path) -> None:
    """A coach_mode without a damping of its own takes that of the vehicle, so that the override has an effect."""
    text = Path(BOGIE).read_text()
    for own, is_warned in ((", stiffness: 0.2 MN/m, damping: 30 kN*s/m", True), ("", False)):
        design = tmp_path / "coach.yaml"
        design.write_text(f"{text}\neffects:\n  - {{kind: coach_mode, at: secondary_lateral, mass: 12000{own}}}\n")
        words = ("ride", str(design), "--track", "erri_b176_low length=200", "--speed", "40")
        done = run(*words, "vehicle.secondary.lateral_damping=60e3")
        message = "vehicle.secondary.lateral_damping: has no effect, the coach_mode at secondary_lateral replaces it"
        assert (message in done.stderr and "change effects.0.damping" in done.stderr) == is_warned
        assert "has no effect" not in run(*words, "vehicle.secondary.yaw_damping=60e3").stderr


def test_an_override_that_contradicts_the_masses_is_warned_of() -> None:
    done = run_ride("--speed", "40", "vehicle.wheel_load=55")
    assert "4 x wheel load is 0.22 kN, the masses weigh" in done.stderr
    assert "the masses weigh" not in run_ride("--speed", "40", "vehicle.wheel_load=54e3").stderr


def test_a_track_without_cross_level_is_noted(tmp_path: Path) -> None:
    rows = [(0.25 * i, 1e-3 * math.sin(i / 9), 2e-4 * math.sin(i / 7)) for i in range(800)]
    for head, columns, is_noted in (("s [m],yw [m]", 2, True), ("s [m],yw [m],phiw [rad]", 3, False)):
        file = tmp_path / "line.csv"
        file.write_text("\n".join([head, *(",".join(f"{x:.7g}" for x in row[:columns]) for row in rows)]) + "\n")
        done = run("ride", BOGIE, "--track", str(file), "--speed", "40")
        assert ("cross-level: taken as zero, line.csv has no phiw" in done.output) == is_noted


def test_a_ride_that_diverges_names_the_linear_critical_speed() -> None:
    words = ("ride", str(ROOT / "designs/check_bogie.yaml"), "--track", "erri_b176_high length=800")
    note = "linear: unstable above 61.64 m/s, and the design has no flange_contact: nothing limits its motion"
    assert note in document(run(*words, "--speed", "80", "--json", "-"))["notes"]
    single, several = run(*words, "--speeds", "30"), run(*words, "--speeds", "30,80")
    assert note in several.output and "linear: unstable" not in single.output
    assert document(run(*words, "--speeds", "30,80", "--json", "-"))["cases"][1]["notes"][-1] == note


def test_speeds_in_km_h_are_shown_with_four_digits() -> None:
    single, several = run_ride("--speed", "140 km/h"), run_ride("--speeds", "140:150:10 km/h")
    assert "at 38.89 m/s (140 km/h)" in single.output and "│ 38.89 " in several.output
    assert "38.888" not in single.output + several.output
    assert document(run_ride("--speed", "140 km/h", "--json", "-"))["speed"] == pytest.approx(140 / 3.6, abs=1e-12)
