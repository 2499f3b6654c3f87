"""Maps over two parameters: values of ride and stability, resumption, refused axes."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from railui import load, ride, stability
from railui.execution.cache import ResultCache
from railui.execution.map_session import MapSession
from railui.execution.threads import ThreadRunner
from railui.optimisation.response_map import case_of, paths_of, read_axis, response_map
from railui.track.excitation import resolve_track
from railui.vehicle.design_reader import load_design
from tests.cli.runner import BOGIE, ROOT, document, run
from tests.execution.small import railui

STIFFNESS, DAMPING = "vehicle.primary.lateral_stiffness", "vehicle.secondary.lateral_damping"
CHECK_BOGIE = ROOT / "designs/check_bogie.yaml"


def test_the_klingel_wavelength_of_a_map_is_that_of_the_formula(tmp_path: Path) -> None:
    """L = 2 pi sqrt(b r/lambda)."""
    words = ("map", str(CHECK_BOGIE), "--x", "contact.conicity=0.1:0.4:0.1", "--of", "klingel_wavelength")
    found = document(
        run(*words, "--y", f"{STIFFNESS}=2 MN/m:4 MN/m:1 MN/m", "-o", str(tmp_path / "m"), "--json", "-", "-q")
    )
    conicity = np.array(found["x"]["values"])
    expected = 2 * np.pi * np.sqrt(0.75 * 0.46 / conicity)
    values = np.array(found["of"]["klingel_wavelength"]["values"])
    np.testing.assert_allclose(values, np.tile(expected, (3, 1)), rtol=1e-12)
    assert found["y"]["values"] == [2e6, 3e6, 4e6] and found["x"]["baseline"] == pytest.approx(0.18)
    assert json.loads((tmp_path / "m/map.json").read_text()) == found
    rows = (tmp_path / "m/map.csv").read_text().splitlines()
    assert rows[0] == f"contact.conicity [1],{STIFFNESS} [N/m],klingel_wavelength [m]" and len(rows) == 13
    assert "vehicle.primary.lateral_stiffness [MN/m]" in (tmp_path / "m/map.svg").read_text()


def test_a_point_of_a_map_is_the_ride_of_the_design_with_both_values() -> None:
    design, track = load_design(BOGIE), "erri_b176_low length=300 seed=1"
    x, y = read_axis(design, f"{STIFFNESS}=2e6:4e6:1e6"), read_axis(design, f"{DAMPING}=2e4:4e4:1e4")
    case = case_of(design, [*x.paths, *y.paths], resolve_track(track), 40.0)
    found = response_map(design, x, y, ["score", "flange_margin"], case)["of"]
    at = load(BOGIE).with_values({STIFFNESS: 4e6, DAMPING: 2e4})
    expected = ride(at, track, 40.0)
    assert found["score"]["values"][0, 2] == expected["score"]
    assert found["flange_margin"]["values"][0, 2] == expected["flange_margin"]
    assert found["score"]["baseline"] == ride(load(BOGIE), track, 40.0)["score"]


def test_vehicles_that_leave_the_track_have_no_value_and_are_counted() -> None:
    design = load_design(CHECK_BOGIE)
    x = read_axis(design, "contact.conicity=0.1:0.4:0.3")
    y = read_axis(design, f"{STIFFNESS}=2e6:3e6:1e6")
    track = resolve_track("erri_b176_high length=800")
    found = response_map(design, x, y, ["score"], case_of(design, [*x.paths, *y.paths], track, 70.0))
    values = found["of"]["score"]["values"]
    assert np.isnan(values[:, 1]).all() and np.isfinite(values[:, 0]).all()
    assert found["failures"] == {"left the track": 2}


def test_a_critical_speed_above_the_search_is_null() -> None:
    design = load_design(CHECK_BOGIE)
    x, y = read_axis(design, "contact.conicity=0.02:0.18:0.16"), read_axis(design, f"{DAMPING}=3e4:3.1e4:1e3")
    found = response_map(design, x, y, ["linear_critical_speed"], case_of(design, [*x.paths, *y.paths], None, None))
    values = found["of"]["linear_critical_speed"]["values"]
    assert np.isnan(values[:, 0]).all() and values[0, 1] == pytest.approx(61.64024, abs=1e-5)
    assert "none up to 90 m/s, 2 vehicles" in found["notes"][0]


def test_a_killed_map_resumes_with_the_same_digits(tmp_path: Path) -> None:
    words = [
        "map",
        BOGIE,
        "--x",
        "contact.conicity=0.2:0.3:0.05",
        "--y",
        f"{DAMPING}=2e4:4e4:2e4",
        "--of",
        "fold_speed",
    ]
    broken, whole = tmp_path / "broken", tmp_path / "whole"
    process = subprocess.Popen(railui(*words, "-o", broken, "--jobs", 1), stderr=subprocess.DEVNULL)
    deadline, stored = time.monotonic() + 120, 0
    while stored < 2 and time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.01)
        if (broken / "results.sqlite").exists():
            cache = ResultCache(broken)
            stored = len(cache)
            cache.close()
    assert process.poll() is None, "the map is too short to be killed"
    process.send_signal(signal.SIGKILL)
    process.wait()
    done = subprocess.run(railui(*words, "-o", broken, "--jobs", 1), capture_output=True, text=True, timeout=240)
    assert done.returncode == 0 and f"{stored} were in" in done.stderr
    assert run(*words, "-o", str(whole), "--jobs", "2", "-q").exit_code == 0
    for name in ("map.json", "map.csv"):
        assert (broken / name).read_bytes() == (whole / name).read_bytes()


def test_the_critical_speed_about_rest_is_that_of_stability() -> None:
    design = load_design(ROOT / "designs/bogie_under_coach.yaml")
    x, y = read_axis(design, "contact.conicity=0.2:0.3:0.1"), read_axis(design, "effects.0.friction=0.3:0.4:0.1")
    case = case_of(design, [*x.paths, *y.paths], None, None)
    found = response_map(design, x, y, ["rest_critical_speed"], case)["of"]["rest_critical_speed"]["values"]
    at = design.with_values(
        {"contact.leading.conicity": 0.3, "contact.trailing.conicity": 0.3, "effects.0.friction": 0.4}
    )
    assert found[1, 1] == stability(at, [60.0, 90.0])["rest_critical_speed"]


def test_vehicles_evaluated_one_by_one_have_the_same_values(monkeypatch: pytest.MonkeyPatch) -> None:
    design = load_design(CHECK_BOGIE)
    x, y = read_axis(design, "contact.conicity=0.1:0.2:0.05"), read_axis(design, f"{DAMPING}=2e4:4e4:1e4")
    case = case_of(design, [*x.paths, *y.paths], None, 40.0)
    together = response_map(design, x, y, ["linear_damping"], case)
    monkeypatch.setattr("railui.optimisation.response_map.NONLINEAR_KEYS", {"linear_damping"})
    apart = response_map(design, x, y, ["linear_damping"], case)
    np.testing.assert_array_equal(apart["of"]["linear_damping"]["values"], together["of"]["linear_damping"]["values"])


def test_a_wider_map_takes_over_the_vehicles_that_it_shares(tmp_path: Path) -> None:
    design, computed = load_design(CHECK_BOGIE), []
    y = read_axis(design, f"{DAMPING}=2e4:4e4:1e4")
    for last in ("0.3", "0.4"):
        x = read_axis(design, f"contact.conicity=0.1:{last}:0.1")
        with MapSession(tmp_path / "m", ThreadRunner(1)) as session:
            case = case_of(design, [*x.paths, *y.paths], None, 40.0)
            response_map(design, x, y, ["linear_damping"], case, session.evaluator)
            computed.append(session.evaluator.count.computed)
    assert computed == [10, 3]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--x", "contact.conicty=0.1:0.2", "--of", "fold_speed"), "--x: no parameter 'contact.conicty', did you mean"),
        (("--x", "contact.conicity=0.2:0.1", "--of", "fold_speed"), "does not increase"),
        (("--x", "contact.conicity=0.1", "--of", "fold_speed"), "write PATH=FIRST:LAST"),
        (("--x", "contact.conicity=0.1 m:0.2", "--of", "fold_speed"), "--x: contact.leading.conicity:"),
        (("--x", "contact.conicity=0.1:0.2:1e-9", "--of", "fold_speed"), "change the step"),
        (("--x", f"{STIFFNESS}=1e6:2e6", "--of", "fold_speed"), "on both axes"),
        (("--x", "contact.conicity=0.1:0.2", "--of", "fold"), "'fold' is no result of ride, stability or curve"),
        (("--x", "contact.conicity=0.1:0.2", "--of", "class"), "class is a word, not a number"),
        (("--x", "contact.conicity=0.1:0.2", "--of", "score"), "score needs a track: give --track"),
        (("--x", "contact.conicity=0.1:0.2", "--of", "linear_damping"), "linear_damping needs a speed: give --speed"),
        (("--x", "riding.journey=1:2", "--of", "fold_speed"), "a criterion of the assessment"),
    ],
)
def test_a_wrong_axis_or_key_names_its_remedy(tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    result = run("map", BOGIE, "--y", f"{STIFFNESS}=2e6:4e6", "-o", str(tmp_path / "m"), *words)
    assert result.exit_code == 2 and result.stdout == ""
    assert message in " ".join(result.stderr.split())


def test_a_numerical_error_is_no_wrong_use(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise np.linalg.LinAlgError("singular matrix")

    monkeypatch.setattr("railui.optimisation.response_map.evaluate_vehicles", fail)
    words = ("--x", "contact.conicity=0.1:0.2", "--y", f"{STIFFNESS}=2e6:4e6", "--of", "linear_critical_speed")
    result = run("map", BOGIE, *words, "-o", str(tmp_path / "m"))
    assert result.exit_code == 1 and "singular matrix" in result.stderr and "Usage" not in result.stderr


def test_a_name_of_a_group_sets_its_members_only_and_not_those_of_deeper_groups() -> None:
    coach = load_design(ROOT / "designs/manchester_coach.yaml")
    assert paths_of(coach, "contact.wheels.conicity") == ["contact.wheels.conicity"]
    assert paths_of(coach, "contact.conicity") == ["contact.wheels.conicity"]
    with pytest.raises(ValueError, match=r"no parameter 'vehicle\.lateral_stiffness'"):
        paths_of(coach, "vehicle.lateral_stiffness")


def test_a_directory_with_other_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text("name: other\n")
    words = ("map", BOGIE, "--x", "contact.conicity=0.1:0.2", "--y", f"{STIFFNESS}=2e6:4e6")
    result = run(*words, "--of", "klingel_wavelength", "-o", str(tmp_path))
    assert result.exit_code == 2 and "such as study.yaml" in result.stderr
