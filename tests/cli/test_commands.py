"""The command line: exit codes, what stands on stdout, the JSON that others build on."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from railui.cli import COMMANDS, cli
from railui.cli.quantities import inclusive_range, parse_seeds, parse_speeds

HOME = Path(__file__).parents[1]
BOGIE = str(HOME / "designs/test_bogie.yaml")
LOW = "erri_b176_low length=300 seed=1"
STUDY = """\
name: small
vehicle: {vehicle}
variables: {{vehicle.secondary.yaw_damping: [5e3, 2e5]}}
cases: {{track: erri_b176_low length=200, speed: 40 m/s, seed: [1], scenario: [{{}}]}}
objectives: [{{minimise: weighted_acceleration}}]
constraints: ["linear_damping >= {least}"]
method: {{population: 4, generations: 2}}
"""


def run(*words: str) -> Result:
    return CliRunner().invoke(cli, list(words))


def document(result: Result) -> dict[str, Any]:
    """The JSON on stdout, which holds nothing else."""
    found: dict[str, Any] = json.loads(result.stdout, parse_constant=lambda word: pytest.fail(word))
    return found


def ride(*words: str) -> Result:
    return run("ride", BOGIE, "--track", LOW, *words)


def test_json_begins_with_the_envelope_and_is_all_of_stdout() -> None:
    result = ride("--speed", "40", "--json", "-")
    assert result.exit_code == 0, result.output
    found = document(result)
    assert list(found)[:5] == ["schema", "version", "inputs", "seed", "simd"]
    assert found["schema"] == "railui.ride/1" and found["seed"] == 1
    assert found["inputs"][0]["file"] == BOGIE and len(found["inputs"][0]["sha256"]) == 64


def test_a_ride_has_the_keys_that_others_build_on() -> None:
    found = document(ride("--speed", "40", "--json", "-"))
    assert set(found) >= {
        *("score", "class", "decided_by", "comfort_hours", "comfort_clipped", "comfort_point"),
        *("weighted_acceleration", "weighted_acceleration_1974", "flange_fraction", "flange_fractions"),
        *("flange_fraction_gaussian", "flange_margin", "n_mv", "wz"),
    }


def test_several_speeds_and_seeds_are_cases_with_mean_and_spread() -> None:
    found = document(ride("--speeds", "30:40:10", "--seeds", "1:3", "--json", "-"))
    assert [(c["speed"], c["seed"]) for c in found["cases"]] == [
        *((30.0, 1), (40.0, 1), (30.0, 2)),
        *((40.0, 2), (30.0, 3), (40.0, 3)),
    ]
    scores = [case["score"] for case in found["cases"]]
    mean = sum(scores) / 6
    assert found["mean"]["score"] == pytest.approx(mean)
    assert found["sd"]["score"] == pytest.approx(math.sqrt(sum((s - mean) ** 2 for s in scores) / 5))
    assert len(found["mean"]["flange_fractions"]) == 2


def test_a_diverged_case_leaves_null_in_the_mean_and_says_so() -> None:
    words = ("ride", str(HOME / "designs/check_bogie.yaml"), "--track", "erri_b176_high length=800")
    found = document(run(*words, "--speeds", "30,80", "--json", "-"))
    assert found["cases"][1]["class"] == "dangerous" and found["mean"]["comfort_hours"] is None
    assert found["notes"][0].endswith("1 of 2 diverged")
    assert run(*words, "--speed", "80", "--strict").exit_code == 4
    assert run(*words, "--speed", "80").exit_code == 0


def test_an_override_counts_as_if_it_stood_in_the_file() -> None:
    from railui import load
    from railui import ride as by_hand

    path = "vehicle.primary.lateral_stiffness"
    found = document(ride("--speed", "144 km/h", f"{path}=4 MN/m", "--json", "-"))
    assert found["overrides"] == {path: "4 MN/m"}
    assert found["score"] == by_hand(load(BOGIE).with_values({path: 4e6}), LOW, 40.0)["score"]


def test_the_table_for_readers_goes_to_stderr_where_json_has_stdout(tmp_path: Path) -> None:
    assert "comfort_hours" in ride("--speed", "40").stdout
    result = ride("--speed", "40", "--json", "-")
    assert result.stdout.startswith("{") and "riding quality" in result.stderr
    assert ride("--speed", "40", "--json", "-", "-q").stderr == ""
    assert ride("--speed", "40", "--json", str(tmp_path / "a.json"), "-q").exit_code == 0
    assert json.loads((tmp_path / "a.json").read_text("utf-8"))["steps"] == 1


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--speed", "144"), "is it in km/h? write 144 km/h"),
        (("--speed", "40 m"), "a unit like m/s is expected"),
        (("--speed", "0"), "give more than 0 m/s"),
        (("--speeds", "60:30"), "runs backwards"),
        (("--speed", "40", "--speeds", "30,40"), "give either --speed or --speeds"),
        ((), "give either --speed or --speeds"),
        (("--speeds", "30", "--seeds", "1,x"), "is no seed"),
        (
            ("--speed", "40", "vehicle.primary.lateral_stifness=4e6"),
            "did you mean 'vehicle.primary.lateral_stiffness'?",
        ),
        (("--speed", "40", "vehicle.primary.lateral_stiffness=4 kg"), "a unit like N/m is expected"),
        (("--speed", "40", "stiff"), "write PATH=VALUE"),
        (("--speed", "40", "--track", "erri_b176_lo"), "did you mean erri_b176_low?"),
        (("--speed", "40", "--track", "no.csv"), "no.csv: cannot be read"),
        (("--speed", "40", "--track", f"{LOW} lenght=3"), "did you mean length?"),
    ],
)
def test_wrong_use_is_told_with_its_remedy_and_ends_with_two(words: tuple[str, ...], told: str) -> None:
    result = ride(*words)
    assert result.exit_code == 2 and result.stdout == ""
    assert told in " ".join(result.stderr.split())


def test_a_vehicle_too_stiff_to_be_stepped_fails_with_one() -> None:
    result = ride("--speed", "0.01 m/s")
    assert result.exit_code == 1
    assert result.stderr.startswith("railui: ")


def test_check_tells_every_problem_at_its_place(tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(Path(BOGIE).read_text("utf-8").replace("yaw_inertia: 3300", "yaw_inertai: 3300 kg"), "utf-8")
    result = run("check", str(path), BOGIE)
    assert result.exit_code == 2
    assert f"{path}:5:" in result.stdout and "did you mean 'yaw_inertia'?" in result.stdout
    found = document(run("check", str(path), "--json", "-"))
    assert {"file", "line", "column", "key", "message", "remedy"} <= set(found["problems"][0])
    assert run("check", BOGIE).exit_code == 0
    assert run("check", str(tmp_path / "absent.yaml")).exit_code == 2


def test_the_bundled_designs_and_studies_are_without_a_problem() -> None:
    files = [*HOME.glob("designs/*.yaml"), HOME / "designs/studies/test_bogie.yaml"]
    result = run("check", *map(str, files))
    assert result.exit_code == 0 and result.stdout == ""


def test_effects_are_told_in_numbers() -> None:
    effects = {e["kind"]: e for e in document(run("effects", "--json", "-"))["effects"]}
    assert {"kind", "title", "at", "source", "parameters"} <= set(effects["free_play"])
    for effect in effects.values():
        for p in effect["parameters"]:
            assert {"key", "symbol", "unit", "default", "minimum", "maximum", "origin"} <= set(p)
            assert all(isinstance(p[key], float) for key in ("default", "minimum", "maximum")), (effect["kind"], p)
    half_width = effects["free_play"]["parameters"][0]
    assert (half_width["unit"], half_width["default"]) == ("m", pytest.approx(3e-4))
    assert effects["spring"]["parameters"][0]["maximum"] == pytest.approx(100 * 0.2e6)


def test_a_track_is_written_and_its_contents_told(tmp_path: Path) -> None:
    file = str(tmp_path / "line.csv")
    assert run("track", "erri_b176_low", "length=2000", "seed=1", "-o", file).exit_code == 0
    found = document(run("track", "--spectrum", file, "--json", "-"))
    assert [(b["from"], b["to"]) for b in found["bands"]] == [(3.0, 25.0), (25.0, 70.0), (70.0, 150.0)]
    assert [b["sd_yw"] for b in found["bands"]] == pytest.approx([0.714e-3, 1.197e-3, 1.539e-3], rel=0.15)
    assert found["nearest"]["name"] == "erri_b176_low" and found["inputs"][0]["file"] == file
    assert len(found["spectrum"]["yw"]) == len(found["spectrum"]["wavenumber"])
    assert run("track", "erri_b176_low").exit_code == 2
    assert run("track", "erri_b176_low", "lenght=2", "-o", file).exit_code == 2


def test_a_track_file_has_no_seeds(tmp_path: Path) -> None:
    file = str(tmp_path / "line.csv")
    assert run("track", *LOW.split(), "-o", file).exit_code == 0
    words = ("ride", BOGIE, "--track", file, "--speed", "40")
    assert document(run(*words, "--seed", "5", "--json", "-"))["seed"] is None  # nothing was random
    refused = run(*words, "--seeds", "1,2")
    assert refused.exit_code == 2 and "it has no seed" in refused.stderr


def test_a_track_on_stdout_is_the_same_as_in_a_file(tmp_path: Path) -> None:
    words = ("track", "fra_4", "length=200", "--seed", "3")
    assert run(*words, "-o", str(tmp_path / "a.csv")).exit_code == 0
    assert run(*words, "-o", "-").stdout == (tmp_path / "a.csv").read_text("utf-8")


def test_optimise_leaves_study_result_and_knee(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(STUDY.format(vehicle=BOGIE, least=0.02), "utf-8")
    result = run("optimise", str(file), "-o", str(tmp_path / "out"), "--json", "-")
    assert result.exit_code == 0, result.stderr
    found = document(result)
    assert set(found) >= {"pareto", "baseline", "knee", "evaluations", "failed"}
    assert set(found["pareto"][0]) == {"variables", "objectives", "constraints", "fresh"} == set(found["baseline"])
    assert json.loads((tmp_path / "out/result.json").read_text("utf-8")) == found
    assert {p.name for p in (tmp_path / "out").iterdir()} == set(
        ["study.yaml", "vehicle.yaml", "result.json", "front.csv", "knee.yaml", "report.html", "results.sqlite", "lock"]
    )
    assert run("check", *map(str, (tmp_path / "out").glob("*.yaml"))).exit_code == 0
    assert "before" in result.stderr


def test_optimise_ends_with_four_where_no_design_is_feasible(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(STUDY.format(vehicle=BOGIE, least=0.95), "utf-8")
    result = run("optimise", str(file), "--json", "-")
    assert result.exit_code == 4
    assert document(result)["pareto"] == [] and "no design keeps the limits" in result.stderr
    assert not (tmp_path / "railui-study/study/knee.yaml").exists()


def test_the_standard_job_is_timed() -> None:
    found = document(run("bench", "--repetitions", "1", "--json", "-"))
    for job in ("full", "reduced"):
        assert found[job]["ns_per_design_step"] == pytest.approx(1e9 / (found[job]["designs_per_second"] * 19999))
    assert {"lanes", "simd", "threads", "alone", "comfort_ns_per_design_step", "crossing_us_per_call"} <= set(found)
    assert [row["threads"] for row in found["scaling"]] == list(range(1, found["threads"] + 1))
    assert found["peak"] is None or found["peak"]["full"]["share"] > 0


def test_a_bench_that_is_kept_tells_the_change_since_the_last(tmp_path: Path) -> None:
    file = tmp_path / "new" / "history.jsonl"
    words = ("bench", "--repetitions", "1", "--keep", str(file))
    assert "the first of this machine" in run(*words).stdout
    file.write_text(file.read_text("utf-8") + '{"half a line', "utf-8")
    assert "ns per design-step, since" in (told := run(*words).stdout) and "coach: " in told
    last = json.loads(file.read_text("utf-8").splitlines()[-1])
    assert set(last["numbers"]) == {"full", "reduced", "coach"} and last["date"] and last["machine"]


def test_an_unknown_command_names_the_nearest() -> None:
    result = run("optimize")
    assert result.exit_code == 2 and "did you mean 'optimise'?" in result.stderr


def test_help_names_every_command_and_reads_none_of_them() -> None:
    script = (
        "import sys\nfrom railui.cli import cli\n"
        "cli(['--help'], standalone_mode=False)\n"
        "print([m for m in sys.modules if m.startswith(('numpy', 'pydantic', 'rich', 'railui.cli.'))])"
    )
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert all(f"  {name} " in out for name in COMMANDS)
    assert out.rstrip().endswith("[]")


def test_a_ranges_ends_are_included() -> None:
    assert inclusive_range(5.0, 90.0, 5.0) == [5.0 * i for i in range(1, 19)]
    assert parse_speeds("30:90 km/h")[0] == pytest.approx(30 / 3.6) and len(parse_speeds("5:90")) == 21
    assert parse_seeds("3,5:7") == [3, 5, 6, 7]


def test_errors_and_ctrl_c_leave_their_codes_with_the_shell() -> None:
    railui = [sys.executable, "-m", "railui"]
    wrong = subprocess.run([*railui, "ride", BOGIE, "--track", LOW, "--speed", "144"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "is it in km/h?" in wrong.stderr and "Traceback" not in wrong.stderr
    words = [*railui, "ride", BOGIE, "--track", "erri_b176_low length=2000", "--speeds", "30:60:0.01"]
    long = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, env=os.environ | {"PYTHONUNBUFFERED": "1"})
    assert long.stderr is not None
    long.stderr.readline()  # the first line of progress
    time.sleep(0.2)
    long.send_signal(signal.SIGINT)
    assert "the same again: railui ride" in long.communicate(timeout=20)[1]
    assert long.returncode == 130
