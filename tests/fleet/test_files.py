"""Files of a fleet: its check, its schema, and runs whose metadata are in a table or in their names."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import pytest

from railui.api.files import check, schema
from railui.documents.recognise import recognise
from railui.fleet.check import with_warnings
from railui.fleet.fleet_file import load_fleet
from railui.fleet.run_list import FleetRun, list_runs
from railui.io.problems import FileProblems
from tests.cli.runner import run as run_cli
from tests.truth.rig_fleet import NOMINAL, RigFleet, write

TEXT = """schema: railui.fleet/1
types: {{rig: {{vehicle: rig.yaml}}}}
vehicles: {{{vehicles}}}
runs: {{{runs}}}
"""


def _home(folder: Path, runs: str, vehicles: str = "a: rig", more: str = "") -> Path:
    (folder / "rig.yaml").write_text(NOMINAL.text())
    (folder / "fleet.yaml").write_text(TEXT.format(runs=runs, vehicles=vehicles) + more)
    return folder


def _touch(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()


def _listed(folder: Path) -> list[FleetRun]:
    return list_runs(load_fleet(folder))


def test_runs_without_a_time_are_numbered_in_the_order_of_their_names(tmp_path: Path) -> None:
    _home(tmp_path, "glob: 'runs/*.csv'")
    _touch(tmp_path, *(f"runs/run{i}.csv" for i in (10, 2, 1)))
    assert [(Path(r.file).name, r.time) for r in _listed(tmp_path)] == [
        ("run1.csv", 1.0), ("run2.csv", 2.0), ("run10.csv", 3.0),
    ]  # fmt: skip


def test_a_regular_expression_reads_the_metadata_from_names(tmp_path: Path) -> None:
    regex = r"regex: '(?P<vehicle>[ab])/.*_(?P<time>\d{4}-\d\d-\d\d)_(?P<temperature>-?\d+)C'"
    _home(tmp_path, f"glob: '**/*.csv', {regex}", "a: rig, b: rig")
    _touch(tmp_path, "a/x_2026-03-02_18C.csv", "b/y_2026-03-01_-4C.csv")
    assert [(r.vehicle, r.time, r.temperature) for r in _listed(tmp_path)] == [("b", 20513.0, -4.0), ("a", 20514.0, 18)]


def test_a_pattern_may_have_wildcards_and_numbers(tmp_path: Path) -> None:
    _home(tmp_path, "pattern: 'runs/*_{time}_{load}.csv'")
    _touch(tmp_path, "runs/x_7_0.5.csv", "runs/y_8_1.csv")
    assert [(r.time, r.load) for r in _listed(tmp_path)] == [(7.0, 0.5), (8.0, 1.0)]


def test_a_field_may_be_repeated_in_a_pattern(tmp_path: Path) -> None:
    _home(tmp_path, "pattern: 'runs/{vehicle}/{vehicle}_{time}.csv'", "a: rig, b: rig")
    _touch(tmp_path, "runs/a/a_7.csv", "runs/b/b_8.csv", "runs/a/b_9.csv")
    assert [(r.vehicle, r.time) for r in _listed(tmp_path)] == [("a", 7.0), ("b", 8.0)]


def test_a_table_keeps_the_names_and_the_delimiter_of_its_owner(tmp_path: Path) -> None:
    _home(tmp_path, "index: runs.csv, columns: {file: Name, time: Run no, temperature: oil}")
    (tmp_path / "runs.csv").write_text("\ufeffName;Run no;operator;oil [degC]\nr1.csv;1;me;20\nr2.csv;2;you;\n")
    assert [(r.time, r.temperature == 20.0) for r in _listed(tmp_path)] == [(1.0, True), (2.0, False)]


def test_faults_of_a_header_are_reported_at_once_with_remedies(tmp_path: Path) -> None:
    _home(tmp_path, "index: runs.csv")
    (tmp_path / "runs.csv").write_text("name,tiem,vehicle\nr1.csv,1,a\n")
    with pytest.raises(FileProblems) as found:
        _listed(tmp_path)
    texts = [str(p) for p in found.value.problems]
    assert all(text.startswith(f"{tmp_path / 'runs.csv'}:1:1: ") for text in texts)
    assert sum("has no column" in text for text in texts) == 2
    assert any("'tiem'" in text and "did you mean 'time'?" in text for text in texts)


def test_names_that_do_not_fit_are_reported_with_the_line_of_the_expression(tmp_path: Path) -> None:
    _home(tmp_path, r"glob: '*.csv', regex: 'r(?P<time>\d+)'")
    _touch(tmp_path, "r1.csv", "other.csv")
    with pytest.raises(FileProblems, match=r"fleet.yaml:4:.*does not match other.csv"):
        _listed(tmp_path)


def test_the_check_reports_all_faults_of_a_fleet_with_their_lines(tmp_path: Path) -> None:
    more = "\n".join(
        [
            "triggers: {sections: {north: [1 m, 2 m]}}",
            "events:",
            "  - {section: nroth, time: 2026-01-01}",
            "  - {time: 2026-01-01}",
            "limits:",
            "  - {parameter: vehicle.rig.stifness, below: 1 N/m}",
            "  - {parameter: vehicle.rig.stiffness, criterion: linear_critical_speed, below: 342 km/h}",
            "settings: {block_day: 1}",
            "",
        ]
    )
    _home(tmp_path, "pattern: 'runs/{vehicle}.csv', regex: '('", "a: rig, b: rag, c: {type: rig, prior: none}", more)
    assert "settings.block_day" in {p.key for p in check(tmp_path / "fleet.yaml")}
    (tmp_path / "fleet.yaml").write_text((tmp_path / "fleet.yaml").read_text().replace("block_day:", "block_days:"))
    lines = {p.key: p.line for p in check(tmp_path)}
    expected = {"vehicles.b": 3, "vehicles.c.prior": 3, "runs.pattern": 4, "runs.regex": 4}
    expected |= {"events.0.section": 7, "events.1": 8, "limits.0.parameter": 10, "limits.1.below": 11}
    assert lines == expected


def test_the_check_reads_the_table_of_runs(tmp_path: Path) -> None:
    _home(tmp_path, "index: runs.csv", "a: rig, b: rig")
    (tmp_path / "runs.csv").write_text("file,vehicle,time\nr1.csv,a,1\nr2.csv,a,2\n")
    problems = check(tmp_path / "fleet.yaml")
    texts = " | ".join(str(p) for p in problems if p.severity == "warning")
    assert "no runs of b" in texts and "block_days: 1" in texts
    fleet = load_fleet(tmp_path)
    assert "2 files are missing" in str(with_warnings(fleet, list_runs(fleet)).warnings[-1])  # of an update
    (tmp_path / "runs.csv").write_text("file,vehicle,time\nr1.csv,z,noon\n")
    result = run_cli("check", str(tmp_path / "fleet.yaml"))
    assert result.exit_code == 2
    assert "runs.csv:2:1: vehicle: no vehicle 'z'" in result.stdout


def test_the_check_reports_missing_and_damaged_runs_at_once(tmp_path: Path) -> None:
    write(RigFleet(rigs=1, runs=14), tmp_path)
    names = [tmp_path / f"runs/rig1_{number:02d}.csv.gz" for number in range(1, 9)]
    assert check(tmp_path / "fleet.yaml") == ()
    rows = gzip.decompress(names[2].read_bytes()).decode().splitlines()
    names[0].unlink()
    names[1].write_bytes(names[1].read_bytes()[:400])
    names[2].write_bytes(gzip.compress("\n".join([rows[0].replace("t [s]", "time [s]"), *rows[1:]]).encode()))
    names[3].write_bytes(gzip.compress("\n".join([rows[0], *reversed(rows[1:])]).encode()))
    names[4].write_bytes(b"")
    cells = rows[9].split(",")
    names[5].write_bytes(gzip.compress("\n".join([*rows[:9], ",".join([cells[0], "x", *cells[2:]])]).encode()))
    names[6].unlink()
    names[6].mkdir()
    result = run_cli("check", str(tmp_path / "fleet.yaml"))
    lines = result.stdout.splitlines()
    assert result.exit_code == 2
    assert f"{tmp_path}/runs.csv:2:1: file: {names[0]} does not exist, correct the path, or leave the line out" in lines
    found = {name: [line for line in lines if line.startswith(f"{name}:")] for name in names[1:7]}
    assert all(found.values()) and not any(str(names[7]) in line for line in lines)
    assert found[names[2]][0].startswith(f"{names[2]}:1:1: t: this column is missing")
    assert f"{names[3]}:3:1: t: " in found[names[3]][0]
    assert f"{names[5]}:10:" in found[names[5]][0]


def test_faulty_lines_of_the_table_do_not_hide_faulty_runs(tmp_path: Path) -> None:
    write(RigFleet(rigs=1, runs=14), tmp_path)
    index = (tmp_path / "runs.csv").read_text().replace("rig1_03.csv.gz,rig1", "rig1_03.csv.gz,rig9")
    (tmp_path / "runs.csv").write_text(index)
    (tmp_path / "runs/rig1_04.csv.gz").unlink()
    problems = {p.line: p.key for p in check(tmp_path) if p.severity == "error"}
    assert problems == {4: "vehicle", 5: "file"}
    with pytest.raises(FileProblems, match=r"runs.csv:4:1: vehicle: "):
        _listed(tmp_path)  # an update needs the whole table


@pytest.mark.parametrize(
    ("content", "fault"),
    [(b"", "is empty, write a header, file,vehicle,time"), (b"\xff\xfef\x00", "is not text in UTF-8, save it as CSV")],
)
def test_a_table_that_is_none_is_reported_with_its_remedy(tmp_path: Path, content: bytes, fault: str) -> None:
    _home(tmp_path, "index: runs.csv")
    (tmp_path / "runs.csv").write_bytes(content)
    for words in (["check"], ["fleet", "run"]):
        result = run_cli(*words, str(tmp_path / "fleet.yaml"))
        assert result.exit_code == 2 and f"runs.csv: {fault}" in result.output


def test_a_file_of_another_kind_is_reported_once(tmp_path: Path) -> None:
    _home(tmp_path, "index: runs.csv")
    result = run_cli("fleet", "run", str(tmp_path / "rig.yaml"))
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert "is a design, but a fleet is required" in line
    assert "does not exist, name a fleet.yaml" in run_cli("fleet", "status", str(tmp_path / "none.yaml")).stderr
    (tmp_path / "empty").mkdir()
    assert "holds no campaign.yaml and no fleet.yaml" in run_cli("check", str(tmp_path / "empty")).stdout


def test_a_limit_of_a_type_that_cannot_be_read_is_no_further_fault(tmp_path: Path) -> None:
    _home(tmp_path, "glob: '*.csv'", more="limits: [{parameter: vehicle.rig.stiffness, below: 1 N/m}]\n")
    (tmp_path / "rig.yaml").unlink()
    (problem,) = check(tmp_path)
    assert problem.key == "types.rig.vehicle"


def test_the_check_warns_of_runs_that_an_update_leaves_out_and_lists_few_warnings_of_a_kind(tmp_path: Path) -> None:
    write(RigFleet(rigs=1, runs=14), tmp_path)
    for file in sorted((tmp_path / "runs").iterdir()):
        rows = gzip.decompress(file.read_bytes()).decode().splitlines()
        rows = [f"{row},0" if number else f"{row},A.Z [m]" for number, row in enumerate(rows)]
        file.write_bytes(gzip.compress("\n".join(rows).encode()))
    (tmp_path / "fleet.yaml").write_text((tmp_path / "fleet.yaml").read_text().replace("3 s}", "60 s}"))
    problems = check(tmp_path / "fleet.yaml")
    assert {p.severity for p in problems} == {"warning"}
    texts = [p.message for p in problems]
    assert sum("column A.Z has no known name" in text for text in texts) == 3
    assert any(text.startswith("11 more warnings of runs") for text in texts)
    (idle,) = (p for p in problems if p.key == "triggers")
    assert idle.message.startswith("14 of 14 runs have no part") and idle.line == 9


def test_the_schema_of_a_fleet_has_its_keys() -> None:
    document = schema("fleet")
    assert document["$id"] == "railui.fleet/1"
    assert {"types", "vehicles", "runs", "triggers", "events", "limits", "settings"} <= set(document["properties"])
    assert json.loads(run_cli("schema", "fleet").stdout) == document


def test_a_fleet_is_recognised_without_its_schema_line(tmp_path: Path) -> None:
    _home(tmp_path, "glob: '*.csv'")
    text = (tmp_path / "fleet.yaml").read_text()
    (tmp_path / "fleet.yaml").write_text(text.partition("\n")[2])
    assert (recognise(tmp_path / "fleet.yaml"), recognise(tmp_path)) == ("fleet", "fleet")
