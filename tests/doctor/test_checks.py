"""Self-test: all checks pass, a wrong value fails with exit code 4, its vehicles are those of the designs."""

from __future__ import annotations

import io
import json
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from railui.cli import cli
from railui.doctor import Check, doctor, machine
from railui.doctor.vehicles import COOPERRIDER, check_bogie
from railui.vehicle.design_reader import Design, load_design, parse_design

HOME = Path(__file__).parents[2]


def test_all_published_values_agree_within_ten_seconds() -> None:
    start = time.process_time()
    result = doctor()
    busy = time.process_time() - start
    assert [check["name"] for check in result["checks"] if not check["ok"]] == []
    assert len(result["checks"]) > 30 and busy < 10


@pytest.mark.parametrize(
    ("name", "design"), [("check_bogie", check_bogie()), ("cooperrider", parse_design(COOPERRIDER))]
)
def test_the_vehicles_of_the_self_test_are_those_of_the_designs(name: str, design: Design) -> None:
    file = load_design(HOME / f"designs/{name}.yaml")
    assert dict(design.values) == pytest.approx(dict(file.values), rel=1e-12)
    assert [(e.kind, dict(e.parameters)) for e in design.effects] == [
        (e.kind, dict(e.parameters)) for e in file.effects
    ]


def test_a_check_depends_on_its_tolerance() -> None:
    assert Check("x", 1.0, 1.0009, "s", 1e-3).is_ok and not Check("x", 1.0, 1.0011, "s", 1e-3).is_ok
    assert (
        Check("x", [None, 1.0], [None, 1.0], "s", 0.0).is_ok and not Check("x", [None, 1.0], [0.5, 1.0], "s", 1.0).is_ok
    )
    assert not Check("x", "v3", "v4", "s").is_ok and not Check("x", 1.0, None, "s", 1.0).is_ok


def test_a_failed_check_is_reported_with_exit_code_4(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("railui.doctor.track_and_comfort.spectrum_sd", lambda *_: 1.0)
    monkeypatch.setattr("railui.doctor.track_and_comfort.comfort_time", lambda *_: 1 / 0)
    done = CliRunner().invoke(cli, ["doctor", "--json", "-", "-q"])
    assert done.exit_code == 4
    report = json.loads(done.stdout)
    failed = [check for check in report["checks"] if not check["ok"]]
    assert len(failed) == 3 and "ZeroDivisionError" in failed[-1]["got"]
    assert {"name", "expected", "got", "ok", "source"} <= set(failed[0])


@pytest.mark.parametrize("kind", ["design", "campaign", "study"])
def test_schemas_are_json_schemas(kind: str) -> None:
    done = CliRunner().invoke(cli, ["schema", kind])
    assert done.exit_code == 0
    assert json.loads(done.stdout)["$schema"].startswith("https://json-schema.org/")
    assert CliRunner().invoke(cli, ["schema", "vehicle"]).exit_code == 2


def test_the_rows_that_decide_about_nonlinear_behaviour_are_among_the_checks() -> None:
    names = " ".join(check["name"] for check in doctor(jobs=1)["checks"])
    for words in (
        "nonlinear critical speed, b 0.9 m",
        "17 degrees of freedom",
        "Polach",
        "Shen",
        "n_mv",
        "wz",
        "guiding",
    ):
        assert words in names
    assert "UTF-8" not in names and "decimal point" not in names


@pytest.mark.parametrize(
    ("flags", "level"), [("avx2 fma avx512f avx512dq", "v4"), ("avx2 fma", "v3"), ("sse2 avx", "portable")]
)
def test_the_simd_level_is_compared_with_the_processor(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, flags: str, level: str
) -> None:
    (tmp_path / "cpuinfo").write_text(f"processor : 0\nflags : {flags}\n")
    monkeypatch.setattr(machine, "CPU_INFO", tmp_path / "cpuinfo")
    monkeypatch.delenv("RAILUI_SIMD", raising=False)
    (check,) = machine.simd_checks(None)
    assert check.expected == level and check.is_ok == (machine.simd_level() == level)
    monkeypatch.setenv("RAILUI_SIMD", "v9")
    assert not next(iter(machine.simd_checks(None))).is_ok


def test_an_output_that_cannot_print_frames_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine.sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="ascii"))
    (check,) = machine.output_checks(None)
    assert not check.is_ok and "PYTHONIOENCODING" in str(check.computed)


def test_a_machine_without_ports_skips_their_check(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "PORT_PATTERNS", ("no such port",))
    assert list(machine.port_checks(None)) == [] and machine.skipped_checks()[0]["reason"] == "the machine has none"


def test_the_table_shows_tolerances() -> None:
    done = CliRunner().invoke(cli, ["doctor"])
    assert "within" in done.output and "5e-06" in done.output
