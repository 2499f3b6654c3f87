"""railui optimise: files of a search, exit codes, plan."""

from __future__ import annotations

import json
from pathlib import Path

from tests.cli.runner import BOGIE, document, run

STUDY = """\
name: small
vehicle: {vehicle}
variables: {{vehicle.secondary.yaw_damping: [5e3, 2e5]}}
cases: {{track: erri_b176_low length=200, speed: 40 m/s, seed: [1], scenario: [{{}}]}}
objectives: [{{minimise: weighted_acceleration}}]
constraints: ["linear_damping >= {least}"]
method: {{population: 4, generations: 2}}
"""


def test_a_search_writes_study_result_and_knee_point(tmp_path: Path) -> None:
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
    assert "baseline" in result.stderr and "knee point" in result.stderr
    assert f"(met in {found['pareto'][0]['fresh']['met'][0]} of 8)" in result.stderr
    assert "knee minus baseline" in result.stderr


def test_a_search_without_a_feasible_design_has_exit_code_4(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(STUDY.format(vehicle=BOGIE, least=0.95), "utf-8")
    result = run("optimise", str(file), "--json", "-")
    assert result.exit_code == 4
    assert document(result)["pareto"] == [] and "no design satisfies the constraints" in result.stderr
    assert not (tmp_path / "railui-study/study/knee.yaml").exists()


def test_a_search_whose_designs_all_fail_prints_the_reasons(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    text = STUDY.format(vehicle=BOGIE, least=0.02).replace('constraints: ["linear_damping >= 0.02"]\n', "")
    variables = "{vehicle.primary.lateral_stiffness: [1e13, 1e14], vehicle.secondary.yaw_damping: [1e11, 1e12]}"
    file.write_text(text.replace("{vehicle.secondary.yaw_damping: [5e3, 2e5]}", variables), "utf-8")
    result = run("optimise", str(file), "--json", "-")
    assert result.exit_code == 4
    found = document(result)
    count = found["failures"]["too stiff to be stepped"]
    assert found["failed"] == found["evaluations"] == count
    assert f"all {count} designs failed: too stiff to be stepped ({count})" in result.stderr
    assert "satisfies the constraints" not in result.stderr
    page = (tmp_path / "railui-study/study/report.html").read_text("utf-8")
    assert f"<h1>All {count} designs failed: too stiff to be stepped ({count}).</h1>" in page
    assert "Nearest to the constraints" not in page


def test_a_number_that_the_front_has_not_is_an_error_after_the_result_is_written(tmp_path: Path) -> None:
    file, out = tmp_path / "study.yaml", tmp_path / "out"
    file.write_text(STUDY.format(vehicle=BOGIE, least=0.02), "utf-8")
    result = run("optimise", str(file), "-o", str(out), "--choose", "0", "--choose", "999")
    assert result.exit_code == 1
    assert f"no design 999 on the front, which has 1, numbered from 0; the result is in {out}" in result.stderr
    assert {"result.json", "front.csv", "knee.yaml", "report.html", "chosen_0.yaml"} <= {p.name for p in out.iterdir()}
    assert json.loads(run("status", str(out), "--json", "-").stdout)["state"] == "finished"
    assert run("optimise", str(file), "--choose", "-1").exit_code == 2


def test_sobol_indices_have_intervals_in_json_table_and_page(tmp_path: Path) -> None:
    file, out = tmp_path / "study.yaml", tmp_path / "out"
    text = STUDY.format(vehicle=BOGIE, least=0.02)
    more = "vehicle.secondary.lateral_damping: [1e4, 6e4]"
    file.write_text(text.replace("[5e3, 2e5]}", f"[5e3, 2e5], {more}}}"), "utf-8")
    result = run("optimise", str(file), "-o", str(out), "--sensitivities", "--samples", "16")
    assert result.exit_code == 0, result.stderr
    found = json.loads((out / "result.json").read_text("utf-8"))
    sobol = found["sensitivities"]["sobol"]
    assert sobol["samples"] == 16 and sobol["confidence"] == 0.95
    row = sobol["variables"][1]
    (low, high), first = row["first_interval"][0], row["first"][0]
    assert low < high and f"{first:.2f} [{low:.2f}, {high:.2f}]" in result.stdout
    assert "95 % intervals" in (out / "report.html").read_text("utf-8")
    assert any("--samples 64" in warning for warning in found["warnings"]) and "--samples 64" in result.stderr
    refused = run("optimise", str(file), "-o", str(out), "--sensitivities", "--samples", "100")
    assert refused.exit_code == 2 and "give 64 or 128" in refused.stderr


def test_a_dry_run_prints_the_size_of_the_search_and_writes_nothing(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(STUDY.format(vehicle=BOGIE, least=0.02), "utf-8")
    result = run("optimise", str(file), "--dry-run", "--json", str(tmp_path / "plan.json"))
    assert result.exit_code == 0, result.stderr
    plan = json.loads((tmp_path / "plan.json").read_text("utf-8"))
    assert f"8 designs by de on 1 case, {plan['samples']:.1e} time steps" in result.stdout
    assert not (tmp_path / "railui-study").exists()
