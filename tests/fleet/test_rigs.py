"""A fleet of rigs in files: new runs, the store, the verdicts, the export and the page."""

from __future__ import annotations

import json
import shutil
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.campaign.settings.fleet import FleetSettings
from railui.documents.saving import save_design
from railui.fleet.alarm import Alarm
from railui.fleet.check import check_fleet
from railui.fleet.course import Course
from railui.fleet.engine import read_part, update_fleet
from railui.fleet.fleet_file import Limit, load_fleet
from railui.fleet.history import Crossing
from railui.fleet.pools import DaskPool, ThreadPool
from railui.fleet.quick_path import Watch, estimates_of_gram, summarise_run
from railui.fleet.reference import Reference, watched_candidates
from railui.fleet.run_list import list_runs
from railui.fleet.status import TypeState, alarm_row, assess_fleet, fleet_document
from railui.fleet.store import RESULTS, FleetStore
from railui.fleet.summary import RunSummary
from railui.io.problems import FileProblems
from railui.report.fleet.alarm_texts import alarm_texts
from railui.runs.run import Run, load_run
from railui.vehicle.design import Adjustment
from railui.vehicle.effects import PlacedEffect
from tests.cli.runner import run as run_cli
from tests.truth.rig_fleet import NOMINAL, RigFleet, stiffness, write

RIGS = RigFleet(rigs=2, runs=6, seed=3)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rigs")
    write(RIGS, folder)
    return folder


@pytest.fixture(scope="module")
def store(home: Path) -> Iterator[FleetStore]:
    directory = home / "one"
    directory.mkdir()
    opened = FleetStore(directory)
    update_fleet(load_fleet(home), opened, ThreadPool(1))
    yield opened
    opened.close()


def _summaries(store: FleetStore) -> dict[str, RunSummary]:
    rows = {Path(row[0]).name: store.read(row[8]) for row in store.runs()}
    return {name: RunSummary.of_arrays(arrays) for name, arrays in rows.items() if arrays is not None}


def test_every_run_estimates_the_stiffness_of_its_rig(store: FleetStore) -> None:
    for name, summary in _summaries(store).items():
        rig, number = int(name[3]) - 1, int(name[5:7]) - 1
        found = dict(zip(summary.paths, summary.estimate, strict=False))["vehicle.rig.stiffness"]
        assert found == pytest.approx(stiffness(RIGS, rig, number), rel=2e-3)


def test_a_fleet_of_addresses_gives_the_same_digits(home: Path, store: FleetStore, tmp_path: Path) -> None:
    """The table and the runs in memory, as they would be in a bucket; the second update reads no run again."""
    fsspec = pytest.importorskip("fsspec")
    memory = fsspec.filesystem("memory")
    for file in (home / "runs.csv", *sorted((home / "runs").iterdir())):
        memory.pipe(f"/rigs/{file.relative_to(home)}", file.read_bytes())
    shutil.copy(home / "rig.yaml", tmp_path)
    text = (home / "fleet.yaml").read_text()
    (tmp_path / "fleet.yaml").write_text(text.replace("index: runs.csv", "index: 'memory://rigs/runs.csv'"))
    opened = FleetStore(tmp_path)
    update = update_fleet(load_fleet(tmp_path), opened, ThreadPool(1))
    again = update_fleet(load_fleet(tmp_path), opened, ThreadPool(1))
    first, second = _summaries(store), _summaries(opened)
    opened.close()
    assert (update.computed, again.computed, again.stored) == (12, 0, 12)
    assert all(np.array_equal(first[name].gram, second[name].gram) for name in first)
    pattern = text.replace("{index: runs.csv}", "{pattern: 'memory://rigs/runs/{vehicle}_{time}.csv.gz'}")
    (tmp_path / "fleet.yaml").write_text(pattern)
    assert [(r.vehicle, r.time) for r in list_runs(load_fleet(tmp_path))][:3] == [
        ("rig1", 1.0), ("rig2", 1.0), ("rig1", 2.0),
    ]  # fmt: skip


def test_an_address_that_cannot_be_opened_is_reported(home: Path, tmp_path: Path) -> None:
    shutil.copy(home / "rig.yaml", tmp_path)
    text = (home / "fleet.yaml").read_text().replace("index: runs.csv", "index: 'memory://none/runs.csv'")
    (tmp_path / "fleet.yaml").write_text(text)
    with pytest.raises(FileProblems, match=r"memory://none/runs\.csv: cannot be read"):
        list_runs(load_fleet(tmp_path))


def test_what_was_computed_is_not_computed_again(home: Path, store: FleetStore) -> None:
    again = update_fleet(load_fleet(home), store, ThreadPool(1))
    assert (again.computed, again.stored) == (0, 12)


def test_the_digits_do_not_depend_on_the_number_of_workers(home: Path, store: FleetStore, tmp_path: Path) -> None:
    other = FleetStore(tmp_path)
    update_fleet(load_fleet(home), other, ThreadPool(2))
    first, second = _summaries(store), _summaries(other)
    other.close()
    assert first.keys() == second.keys()
    assert all(np.array_equal(first[name].gram, second[name].gram) for name in first)


def test_a_cluster_on_which_a_worker_dies_gives_the_same_digits(home: Path, store: FleetStore, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    from railui.execution.dask_cluster import DaskRunner
    from tests.execution.cluster import LocalCluster

    machines = LocalCluster(tmp_path)
    (tmp_path / "results").mkdir()
    other = FleetStore(tmp_path / "results")
    try:
        doomed, _ = machines.start_workers(2)
        runner = DaskRunner(machines.address)
        timer = threading.Timer(0.5, doomed.kill)
        timer.start()
        update = update_fleet(load_fleet(home), other, DaskPool(runner))
        timer.join()
        runner.close()
    finally:
        machines.stop()
    first, second = _summaries(store), _summaries(other)
    other.close()
    assert (update.computed, update.left_out) == (12, {})
    assert all(np.array_equal(first[name].gram, second[name].gram) for name in first)


def test_a_new_run_alone_is_computed(home: Path, tmp_path: Path) -> None:
    folder = tmp_path / "rigs"
    shutil.copytree(home, folder, ignore=shutil.ignore_patterns("one"))
    index = (folder / "runs.csv").read_text().splitlines()
    (folder / "runs.csv").write_text("\n".join(index[:-1]) + "\n")
    opened = FleetStore(tmp_path)
    before = update_fleet(load_fleet(folder), opened, ThreadPool(1))
    (folder / "runs.csv").write_text("\n".join(index) + "\n")
    after = update_fleet(load_fleet(folder), opened, ThreadPool(1))
    opened.close()
    assert (before.computed, after.computed, after.stored) == (11, 1, 11)


def test_a_damaged_row_of_the_store_is_computed_again(home: Path, tmp_path: Path) -> None:
    opened = FleetStore(tmp_path)
    update_fleet(load_fleet(home), opened, ThreadPool(1))
    before = _summaries(opened)
    damaged = opened.runs()[0][8]
    opened.database.execute("UPDATE results SET payload = zeroblob(20) WHERE hash = ?", (damaged,))
    assert opened.read(damaged) is None
    again = update_fleet(load_fleet(home), opened, ThreadPool(1))
    after = _summaries(opened)
    opened.close()
    assert (again.computed, again.stored) == (1, 11)
    assert all(np.array_equal(before[name].gram, after[name].gram) for name in before)


def test_a_missing_file_is_left_out_unless_its_summary_is_stored(home: Path, tmp_path: Path) -> None:
    folder = tmp_path / "rigs"
    shutil.copytree(home, folder, ignore=shutil.ignore_patterns("one"))
    (folder / "runs" / "rig2_06.csv.gz").unlink()
    opened = FleetStore(tmp_path)
    first = update_fleet(load_fleet(folder), opened, ThreadPool(1))
    (folder / "runs" / "rig1_05.csv.gz").unlink()
    shutil.copy(home / "runs" / "rig2_06.csv.gz", folder / "runs")
    second = update_fleet(load_fleet(folder), opened, ThreadPool(1))
    opened.close()
    reasons = {Path(file).name: reason for file, reason in first.left_out.items()}
    assert reasons == {"rig2_06.csv.gz": "cannot be read: No such file or directory"}
    assert (first.computed, first.stored) == (11, 0)
    assert (second.computed, second.stored, second.left_out) == (1, 11, {})


def test_the_check_reads_only_runs_without_a_summary(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "rigs"
    shutil.copytree(home, folder, ignore=shutil.ignore_patterns("one"))
    (folder / RESULTS).mkdir()
    opened = FleetStore(folder / RESULTS)
    update_fleet(load_fleet(folder), opened, ThreadPool(1))
    opened.close()
    (folder / "runs/rig1_05.csv.gz").unlink()
    (folder / "runs/rig2_06.csv.gz").write_bytes(b"no gzip")
    read: list[str] = []

    def counted(file: str, *more: object) -> Run:
        read.append(Path(file).name)
        return load_run(file, *more)  # type: ignore[arg-type]

    monkeypatch.setattr("railui.fleet.run_check.load_run", counted)
    with pytest.raises(FileProblems) as found:
        check_fleet(folder)
    assert read == ["rig2_06.csv.gz"]
    assert {Path(p.file).name for p in found.value.problems if p.severity == "error"} == {"rig2_06.csv.gz"}
    (folder / RESULTS / "fleet.sqlite").write_bytes(b"damaged")
    with pytest.raises(FileProblems, match=r"runs.csv:\d+:1: file: .*rig1_05.csv.gz does not exist"):
        check_fleet(folder)
    assert len(read) == 12  # eleven of twelve files exist


def test_a_broken_run_is_left_out_with_its_reason(home: Path, tmp_path: Path) -> None:
    folder = tmp_path / "rigs"
    shutil.copytree(home, folder, ignore=shutil.ignore_patterns("one"))
    (folder / "runs" / "rig2_06.csv.gz").write_bytes(b"no gzip")
    opened = FleetStore(tmp_path)
    update = update_fleet(load_fleet(folder), opened, ThreadPool(1))
    opened.close()
    assert [Path(file).name for file in update.left_out] == ["rig2_06.csv.gz"]


def test_one_machine_with_numbered_runs_is_followed_without_metadata(tmp_path: Path) -> None:
    order = RigFleet(rigs=1, runs=26, seed=5, loss=0.3, onset=14)
    write(order, tmp_path)
    (tmp_path / "fleet.yaml").write_text(
        "types: {rig: {vehicle: rig.yaml, watch: []}}\nvehicles: {machine: rig}\nruns: {glob: 'runs/*.csv.gz'}\n"
        "settings: {block_days: 1, reference_runs: 3}\n"
    )
    assert check_fleet(tmp_path).warnings == ()
    opened = FleetStore(tmp_path)
    update_fleet(load_fleet(tmp_path), opened, ThreadPool(1))
    (state,) = assess_fleet(load_fleet(tmp_path), opened)
    opened.close()
    first = state.alarms[0]
    assert (first.vehicle, first.name) == ("machine", "vehicle.rig.stiffness")
    assert order.onset < first.raised < order.onset + 13


@pytest.mark.parametrize(
    ("kind", "numbers"),
    [("dry_friction", {"force": 0.5, "slip_speed": 1e-2}), ("free_play", {"half_width": 1e-6})],
)
def test_a_vehicle_with_the_effects_of_a_loop_is_followed_among_others(
    home: Path, tmp_path: Path, kind: str, numbers: dict[str, float]
) -> None:
    """The second rig has an effect of a watched kind, which its runs estimate; quantities are those of all rigs."""
    design = load_fleet(home).types["rig"].campaign.design
    calibrated = design.with_effects([PlacedEffect(kind, "rig", None, numbers)])
    names = ("vehicle.rig.stiffness", f"effects.0.{next(iter(numbers))}")
    adjustment = Adjustment("rig2", "0" * 64, names, ((1e6, 0.0), (0.0, 1e-4)))
    (tmp_path / "loop").mkdir()
    save_design(replace(calibrated, adjustment=adjustment), tmp_path / "loop/adjusted.yaml")
    (tmp_path / "loop/loop.json").write_text("{}")
    shutil.copy(home / "rig.yaml", tmp_path)
    text = (home / "fleet.yaml").read_text().replace("index: runs.csv", f"index: {home / 'runs.csv'}")
    text = text.replace("rig2: rig", "rig2: {type: rig, prior: loop}")
    (tmp_path / "fleet.yaml").write_text(text)
    fleet = load_fleet(tmp_path)
    opened = FleetStore(tmp_path)
    update = update_fleet(fleet, opened, ThreadPool(1))
    assert update.left_out == {}
    summaries = _summaries(opened)
    (state,) = assess_fleet(fleet, opened)
    opened.close()
    assert set(summaries["rig2_01.csv.gz"].paths) - set(summaries["rig1_01.csv.gz"].paths) == {names[1]}
    quantities = [q.name for q in state.data.quantities]
    assert names[0] in quantities and names[1] not in quantities
    j = quantities.index(names[0])
    truth = [stiffness(RIGS, v, int(t) - 1) for v, t in zip(state.data.vehicle, state.data.time, strict=True)]
    assert state.data.y[:, j] * state.data.quantities[j].scale == pytest.approx(truth, rel=5e-3)


def _softening(state: TypeState, onset: float, rate: float) -> Alarm:
    """An alarm of the second rig whose stiffness changes by a share per day."""
    j = [q.name for q in state.data.quantities].index("vehicle.rig.stiffness")
    one, crossing = np.ones(1), Crossing(1, 4, (j,), (9.0,), 1)
    course = Course(
        onset,
        onset,
        onset,
        rate,
        0.0,
        rate,
        0.0,
        onset * one,
        one,
        rate * one,
        0.0 * one,
        0.0 * one,
        0.0 * one,
        0.0,
        1.0,
    )
    return Alarm(
        crossing,
        "rig2",
        onset + 9.0,
        "parameter",
        state.data.quantities[j].name,
        (),
        1.0,
        rate,
        0.1,
        rate,
        0.1,
        course,
        crossing,
        j,
        (),
    )


def test_the_limit_that_is_reached_first_is_reported(home: Path, store: FleetStore) -> None:
    fleet = load_fleet(home)
    (state,) = assess_fleet(fleet, store)
    path = "vehicle.rig.stiffness"
    limits = (Limit(path, 40e3, True), Limit(path, 50e3, True), Limit(path, 90e3, False))
    for rate, limit in ((-0.01, 50e3), (0.01, 90e3)):
        row = alarm_row(replace(fleet, limits=limits), state, _softening(state, 3.0, rate), {}, is_date=False)
        assert row["limit"]["limit"] == limit
        assert 3.0 < float(row["limit"]["day"]) < 80.0


@pytest.mark.parametrize("rate", [-0.01, 0.01])
def test_a_limit_exceeded_before_the_onset_is_reported_as_such(home: Path, store: FleetStore, rate: float) -> None:
    """Also where the parameter returns towards its limit, and before another limit that is reached later."""
    fleet = load_fleet(home)
    (state,) = assess_fleet(fleet, store)
    path = "vehicle.rig.stiffness"
    limits = (Limit(path, 50e3, True), Limit(path, 75e3, True), Limit(path, 90e3, False))
    row = alarm_row(replace(fleet, limits=limits), state, _softening(state, 3.0, rate), {}, is_date=False)
    limit = row["limit"]
    assert limit["limit"] == limit["value"] == 75e3 and limit["exceeded_before"]
    assert (limit["day"], limit["low"], limit["high"], limit["probability"]) == (None, None, None, 1.0)
    assert alarm_texts(row)["limit"] == f"{path} 75000: exceeded before the onset"


def test_days_after_the_tenth_year_are_numbers_where_the_runs_have_numbers(home: Path, store: FleetStore) -> None:
    fleet = load_fleet(home)
    (state,) = assess_fleet(fleet, store)
    late = replace(state, alarms=(_softening(state, 4000.0, -0.01),))
    (alarm,) = fleet_document(fleet, [late])["alarms"]
    assert (alarm["raised"], alarm["onset"]["day"]) == ("4009", "4000")
    assert 4000.0 < float(alarm["limit"]["day"]) < 4030.0


def test_a_limit_reached_after_the_year_9999_has_no_date(home: Path, store: FleetStore) -> None:
    fleet = load_fleet(home)
    (state,) = assess_fleet(fleet, store)
    days = np.asarray(state.data.time) + 20000.0
    late = replace(state, data=replace(state.data, time=days), alarms=(_softening(state, 20003.0, -1e-9),))
    (alarm,) = fleet_document(fleet, [late])["alarms"]
    assert alarm["raised"] == "2024-10-16"
    assert alarm["limit"]["day"] is None


def test_runs_that_are_too_short_are_left_out_with_the_reason(home: Path, tmp_path: Path) -> None:
    shutil.copy(home / "rig.yaml", tmp_path)
    text = (home / "fleet.yaml").read_text().replace("min_duration: 3 s", "min_duration: 9 s")
    (tmp_path / "fleet.yaml").write_text(text.replace("runs.csv", str(home / "runs.csv")))
    opened = FleetStore(tmp_path)
    update = update_fleet(load_fleet(tmp_path), opened, ThreadPool(1))
    opened.close()
    few = "0 of 6 runs can be used, 3 are needed; no part fulfils the triggers"
    assert set(update.left_out.values()) == {f"no reference of rig{i}: {few}" for i in (1, 2)}


def test_a_sensor_that_reads_ten_per_cent_more_is_half_of_the_followed_gain(home: Path, store: FleetStore) -> None:
    """The followed effect multiplies a channel by 1.2; its amount for a gain of 1.1 is 0.5."""
    fleet = load_fleet(home)
    vehicle = fleet.vehicles["rig1"]
    part = read_part(str(home / "runs" / "rig1_02.csv.gz"), vehicle.type, fleet.triggers)
    assert part is not None
    key = next(key for key in store.keys("reference"))
    reference = Reference.of_arrays(store.read(key) or {})
    type_ = vehicle.type
    object.__setattr__(type_, "watch", ("sensor_gain",))
    watch = Watch(tuple(watched_candidates(vehicle, part.segment)))
    before = summarise_run(vehicle, reference, watch, FleetSettings(), part.segment)
    part.segment.columns["z"][:] *= 1.1  # type: ignore[index]
    after = summarise_run(vehicle, reference, watch, FleetSettings(), part.segment)
    at = len(before.paths) + before.directions.index("sensor_gain at z")
    assert after.estimate[at] - before.estimate[at] == pytest.approx(0.5, abs=0.1)


def test_estimates_follow_from_inner_products_as_from_the_rows() -> None:
    rng = np.random.default_rng(0)
    rows = rng.standard_normal((5, 200))
    x, prior, sd = np.array([1.0, 2.0]), np.array([0.9, 2.1]), np.array([0.5, 0.5])
    gram = rows @ rows.T
    estimate, deviation, _ = estimates_of_gram(gram, x, prior, sd, 1.0)
    r, s, d = rows[0], rows[1:3], rows[3:]
    a = s @ s.T + np.diag(1.0 / sd**2)
    step = np.linalg.solve(a, s @ r + (prior - x) / sd**2)
    assert estimate[:2] == pytest.approx(x + step)
    assert deviation[:2] == pytest.approx(np.sqrt(np.diag(np.linalg.inv(a))))
    left = d[0] @ d[0] - d[0] @ s.T @ np.linalg.solve(a, s @ d[0])
    assert estimate[2] == pytest.approx(d[0] @ (r - s.T @ step) / left)


def test_faults_of_the_file_are_reported_with_their_line(home: Path, tmp_path: Path) -> None:
    text = (home / "fleet.yaml").read_text()
    (tmp_path / "rig.yaml").write_text(NOMINAL.text())
    (tmp_path / "runs.csv").write_text("file,vehicle,time\n")
    file = tmp_path / "fleet.yaml"
    file.write_text(text.replace("dry_friction", "dry_fricton").replace("rig2: rig", "rig2: rag"))
    with pytest.raises(FileProblems) as found:
        load_fleet(file)
    problems = {p.key: (p.line, p.remedy) for p in found.value.problems}
    assert problems["types.rig.watch.1"][1] == "did you mean 'dry_friction'?"
    assert problems["vehicles.rig2"][1] == "did you mean 'rig'?"
    assert all(line > 0 for line, _ in problems.values())


def test_faults_of_the_table_of_runs_are_reported_with_their_line(home: Path, tmp_path: Path) -> None:
    shutil.copy(home / "rig.yaml", tmp_path)
    shutil.copy(home / "fleet.yaml", tmp_path)
    (tmp_path / "runs.csv").write_text("file,vehicle,time\na.csv,rig9,1\nb.csv,rig1,noon\n")
    with pytest.raises(FileProblems) as found:
        update_fleet(load_fleet(tmp_path), FleetStore(tmp_path), ThreadPool(1))
    assert [(p.line, p.key) for p in found.value.problems] == [(2, "vehicle"), (3, "time")]


def test_status_since_a_day_lists_later_alarms_alone(tmp_path: Path) -> None:
    results = tmp_path / "railui-fleet"
    results.mkdir()
    alarm = {"vehicle": "a", "verdict": "outside", "quantity": "error at z", "relative_change": None, "change": None}
    alarm |= {"onset": None, "limit": None}
    document = {"fleet": "f", "vehicles": [], "sections": [], "false_alarms_per_vehicle_month": 0.02}
    document |= {"runs": {"all": 0, "waiting": 0, "left_out": {}}}
    document["alarms"] = [{**alarm, "raised": day} for day in ("2026-03-01", "2026-05-01")]
    (results / "fleet.json").write_text(json.dumps(document))
    result = run_cli("fleet", "status", str(tmp_path / "fleet.yaml"), "--since", "2026-04-01", "--json", "-", "-q")
    assert [row["raised"] for row in json.loads(result.stdout)["alarms"]] == ["2026-05-01"]


def test_parquet_has_a_row_per_run_and_quantity(home: Path, store: FleetStore, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    from railui.fleet.parquet import export_parquet

    files, rows = export_parquet(load_fleet(home), store, tmp_path)
    table = parquet.read_table(tmp_path)
    summary = next(iter(_summaries(store).values()))
    per_run = len(summary.estimate) + len(summary.channels)
    assert (files, rows, table.num_rows) == (2, 12 * per_run, 12 * per_run)
    assert set(table.column("vehicle").to_pylist()) == {"rig1", "rig2"}
