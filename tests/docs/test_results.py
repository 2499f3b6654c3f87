"""docs/results.md has a row for every key of the commands' JSON, and no other rows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from railui.cli import cli
from railui.identification.estimation.identifiability import estimate_per_section, profile_likelihood
from railui.identification.estimation.parallel_models import residual_correlations
from railui.identification.unmodelled.coefficients import estimate_coefficients
from railui.io.table import write_table
from railui.report.loop import identifiability as tables
from tests.blind.simulated import calibrated, simulated_campaign
from tests.capture.simulated_runs import sensor_readings, simulated_motion
from tests.docs.results import rows_of, sections, superfluous_rows, undocumented_keys
from tests.docs.transcript import ROOT

BOGIE, COACH = "designs/test_bogie.yaml", "designs/manchester_coach.yaml"
PROFILES = ["designs/profiles/s1002.txt", "designs/profiles/60e1.txt"]
LOW = ["--track", "erri_b176_low length=400 seed=1"]
HIGH = ["--track", "erri_b176_high length=800", "--speed", "80"]
MASS = ["vehicle.wheel_load=56e3"]
GRID = ["--x", "contact.conicity=0.1:0.4:0.3", "--y", "vehicle.primary.lateral_stiffness=2e6:3e6:1e6"]
STUDY = f"""\
name: small
vehicle: {ROOT / BOGIE}
variables: {{vehicle.secondary.yaw_damping: [5e3, 2e5], vehicle.primary.lateral_stiffness: [1e6, 8e6]}}
cases: {{track: erri_b176_low length=200, speed: 40 m/s, seed: [1], scenario: [{{}}]}}
objectives: [{{minimise: weighted_acceleration}}, {{maximise: flange_margin}}]
constraints: ["linear_damping >= LEAST"]
method: {{population: 4, generations: 2}}
"""
CASES = {
    "ride": [
        [BOGIE, *LOW, "--speed", "40", "vehicle.wheel_load=56e3"],
        [COACH, *LOW, "--speed", "40"],
        [BOGIE, *LOW, "--speeds", "30,40"],
        ["designs/check_bogie.yaml", "--track", "erri_b176_high length=800", "--speed", "80"],
        [BOGIE, "--track", "designs/lines/reverse_curves.yaml", "--speed", "25"],
    ],
    "stability": [
        [BOGIE, "--speeds", "20:80:20"],
        ["designs/check_bogie.yaml", "--speeds", "40:80:20", "--fold", *LOW],
    ],
    "curve": [[BOGIE, "--radius", "600"], [BOGIE, "--radii", "500,600"]],
    "response": [
        [BOGIE, "--speed", "40", "--track", "erri_b176_low", "--frequencies", "1:5:1", "vehicle.wheel_load=56e3"],
        [COACH, "--speed", "40", "--frequencies", "1:5:1"],
    ],
    "map": [
        [BOGIE, *GRID, "--of", "klingel_wavelength", "-o", "m", "vehicle.wheel_load=56e3"],
        ["designs/check_bogie.yaml", *GRID, *HIGH, "--of", "score", "-o", "m"],
    ],
    "sensitivity": [
        [BOGIE, "--of", "klingel_wavelength", "vehicle.wheel_load=56e3"],
        ["designs/check_bogie.yaml", *LOW, "--speed", "40", "--of", "score", "--seeds", "1,2"],
    ],
    "assess": [["line.csv", BOGIE, "--speed", "40"]],
    "assess --method en14363": [["line.csv", BOGIE, "--speed", "40"]],
    "contact": [
        PROFILES,
        ["--delta-r", "delta_r.csv"],
        ["designs/profiled_bogie.yaml", "vehicle.wheel_load=56e3", *LOW, "--speed", "40", "--once"],
    ],
    "plan": [
        [BOGIE, "--sensors", "designs/plans/test_bogie.yaml", "--speeds", "30,40", *LOW, "--duration", "20", *MASS],
    ],
    "export": [[BOGIE, "--state-space", "b.npz", "--speed", "40", *MASS], [BOGIE, "--fmu", *MASS]],
    "track": [["--spectrum", "line.csv"]],
    "check": [["absent.yaml"]],
    "diff": [[BOGIE, "designs/check_bogie.yaml"]],
    "effects": [[]],
    "doctor": [[]],
    "bench": [["--repetitions", "1"], ["--precision"]],
}


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "designs").symlink_to(ROOT / "designs")
    monkeypatch.chdir(tmp_path)
    CliRunner().invoke(cli, ["track", "erri_b176_low", "length=1000", "-o", "line.csv"])
    lines = [f"{k / 2},{0.2 * k}" for k in range(-20, 21)]
    Path("delta_r.csv").write_text("\n".join(["y [mm],delta_r [mm]", *lines]) + "\n")
    return tmp_path


def run(*words: str) -> Any:
    """Run a command and return its JSON."""
    done = CliRunner().invoke(cli, [*words, "--json", "-", "-q"], prog_name="railui")
    assert done.exit_code in (0, 2, 4), done.output
    assert done.stdout.startswith("{"), done.output
    return json.loads(done.stdout)


def assert_documented(documents: list[Any], *headings: str) -> None:
    rows = rows_of(*headings)
    assert documents and all(documents)
    assert undocumented_keys(documents, rows) == []
    assert superfluous_rows(documents, rows) == []


@pytest.mark.parametrize("name", CASES)
def test_the_page_lists_exactly_the_keys_of_a_command(home: Path, name: str) -> None:
    assert_documented([run(*name.split(), *words) for words in CASES[name]], name)


def test_the_page_lists_exactly_the_keys_of_a_search(home: Path) -> None:
    documents = []
    for least, words in (("0.02", ["--sensitivities"]), ("0.9", [])):
        Path(f"{least}.yaml").write_text(STUDY.replace("LEAST", least))
        documents.append(run("optimise", f"{least}.yaml", "-o", f"out_{least}", *words))
    plan = run("optimise", "0.02.yaml", "--dry-run")
    assert_documented([*documents, plan], "optimise")
    assert_documented([run("status", "out_0.02")], "status")


def test_the_page_lists_the_keys_of_the_identifiability_tables() -> None:
    fit, context = calibrated(), simulated_campaign().context
    path = "contact.leading.conicity"
    report = {
        "correlations": tables.correlation_rows(residual_correlations(context, fit)),
        "coefficients": tables.coefficient_rows(estimate_coefficients(context, fit)),
        "stretches": tables.segment_rows(estimate_per_section(context, fit, 300.0)),
        "profile": tables.profile_rows([profile_likelihood(context, fit, path)]),
    }
    assert undocumented_keys([report], sections()["adjust"]) == []


def test_the_page_lists_exactly_the_keys_of_a_recording(home: Path) -> None:
    document = run("capture", "--demo", "--seconds", "3", "-o", "got")
    assert_documented([document, run("capture", "decode", "got/raw.bin", "-o", "again")], "capture")


def test_the_page_lists_exactly_the_keys_of_an_import(home: Path) -> None:
    columns, sensors = simulated_motion(), sensor_readings(simulated_motion())
    names = ("ay1", "ay2", "e1_right", "e1_left", "e2_right", "e2_left", "roll_rate1")
    channels = {name: sensors[name] for name in names} | {"v": columns["v"].copy()}
    channels["v"][: len(columns["t"]) // 4] = 0.0  # standstill at the start
    units = [{"a": "m/s^2", "e": "m", "r": "rad/s"}[name[0]] for name in names] + ["m/s"]
    headers = [f"{name} [{unit}]" for name, unit in zip(channels, units, strict=True)]
    write_table("rec.csv", dict(zip(["t [s]", *headers], [columns["t"], *channels.values()], strict=True)))
    lines = [f"  {name}: {{channel: {name}}}" for name in names]
    vehicle = f"vehicle: {ROOT / BOGIE}\nspeed: {{channel: v}}\nsensors:"
    Path("map.yaml").write_text("\n".join([vehicle, *lines]) + "\n")
    assert_documented([run("import", "rec.csv", "--map", "map.yaml", "-o", "run.csv")], "import")


def test_the_comparison_detects_missing_and_superfluous_rows() -> None:
    rows = {"a.NAME.b": "of every name", "c": "where asked for", "d.0.e": ""}
    document = {"a": {"x.y": {"b": 1}}, "d": []}
    assert undocumented_keys([document], rows) == superfluous_rows([document], rows) == []
    assert undocumented_keys([{"a": {"x": {"z": 1}}}], rows) == ["a.x.z"]
    assert superfluous_rows([{"a": {"x": {"b": 1}}}], rows) == ["d.0.e"]
