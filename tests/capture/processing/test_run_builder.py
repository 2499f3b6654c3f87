"""Recordings of a bogie and of a test rig to runs."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from railui.capture.formats import write_recording
from railui.capture.processing.measured_run import MeasuredRun, save_run
from railui.capture.processing.recording import Recording
from railui.capture.processing.run_builder import build_measured_run
from railui.capture.processing.sensor_map import load_map
from railui.cli import cli
from railui.cli.import_ import show_imported_run
from railui.cli.invocation import Invocation
from railui.documents.check import check
from railui.runs.run import load_run
from tests.capture.simulated_runs import SERIES, UNITS, T, sensor_readings, simulated_motion, write_map


def test_gravity_on_a_lateral_axis_gives_a_note(tmp_path: Path) -> None:
    columns = simulated_motion()
    signals = sensor_readings(columns)
    names = ("ay1", "ay2", "e1_right", "e1_left", "e2_right", "e2_left", "roll_rate1")
    channels = {name: signals[name] for name in names} | {"v": columns["v"]}
    channels["ay1"] = channels["ay1"] + 9.81
    units: dict[str, str | None] = {n: "m" for n in names} | {
        "ay1": "m/s^2",
        "ay2": "m/s^2",
        "roll_rate1": "rad/s",
        "v": "m/s",
    }
    path = write_map(tmp_path, "sensors:\n" + "".join(f"  {n}: {{channel: {n}}}\n" for n in names))
    run = build_measured_run(Recording("a", columns["t"], channels, units), load_map(path))
    assert any("ay1" in note and "gravity is on its axis" in note for note in run.notes)


def test_a_note_on_gravity_states_whether_it_was_removed(tmp_path: Path) -> None:
    columns = simulated_motion()
    signals = sensor_readings(columns)
    names = ("ay1", "ay2", "e1_right", "e1_left", "e2_right", "e2_left", "roll_rate1")
    units: dict[str, str | None] = {n: "m" for n in names} | {"v": "m/s"}
    units |= {"ay1": "m/s^2", "ay2": "m/s^2", "roll_rate1": "rad/s"}
    recording = Recording("a", columns["t"], {name: signals[name] for name in names} | {"v": columns["v"]}, units)
    for mapped, has_roll in ((names, True), (names[:-1], False)):
        path = write_map(tmp_path, "sensors:\n" + "".join(f"  {n}: {{channel: {n}}}\n" for n in mapped))
        notes = build_measured_run(recording, load_map(path)).notes
        assert any("is taken out of ay1, ay2" in note for note in notes) == has_roll
        assert any("remains in the accelerations" in note for note in notes) != has_roll


def test_standstill_at_the_start_is_ignored(tmp_path: Path) -> None:
    columns = simulated_motion()
    sensors = {name: x for name, x in sensor_readings(columns).items() if name[0] in "ae" or name == "roll_rate1"}
    speed = np.where(columns["t"] < columns["t"][0] + 12.0, 0.0, columns["v"])
    units: dict[str, str | None] = {"v": "m/s"}
    units |= {name: {"a": "m/s^2", "e": "m", "r": "rad/s"}[name[0]] for name in sensors}
    path = write_map(tmp_path, "sensors:\n" + "".join(f"  {name}: {{channel: {name}}}\n" for name in sensors))
    run = build_measured_run(Recording("a", columns["t"], sensors | {"v": speed}, units), load_map(path))
    assert "12 s at a standstill are ignored" in run.notes
    assert run.columns["t"][0] >= columns["t"][0] + 12.0 and np.all(run.columns["v"] > 1.0)
    assert run.rail_quality is not None and run.rail_quality.correlation > 0.9


def test_recording_of_a_test_rig_becomes_a_run(tmp_path: Path) -> None:
    write_recording(tmp_path / "bench.mf4", Recording("a", T, SERIES, UNITS))
    (tmp_path / "map.yaml").write_text("sensors: {u: {channel: acc_y}, z: {channel: way}}\n")
    arguments = [
        "import",
        str(tmp_path / "bench.mf4"),
        "--map",
        str(tmp_path / "map.yaml"),
        "-o",
        str(tmp_path / "r.csv.gz"),
    ]
    result = CliRunner().invoke(cli, arguments)
    assert result.exit_code == 0, result.output
    run = load_run(tmp_path / "r.csv.gz")
    assert run.kind == "rig" and run.units["z"] == "mm" and np.allclose(run.columns["z"], SERIES["way"], atol=1e-9)


def test_table_of_the_rail_position_states_units(capsys: pytest.CaptureFixture[str]) -> None:
    quality = SimpleNamespace(
        valid=(3.0, 70.0), lag=0.01, bands=[(3.0, 25.0, 7e-4, 1e-4)], errors=(0.07,), roll_share=(0.0,)
    )
    run = SimpleNamespace(
        columns={"t": T}, counts={"rows": len(T), "gaps": 0}, notes=(), rail_quality=quality, natural_frequency=2.0
    )
    show_imported_run(Invocation(), "run.csv.gz", run)  # type: ignore[arg-type]
    shown = capsys.readouterr().out
    assert "wavelengths [m]" in shown and "sd yw [mm]" in shown and "difference of both wheelsets [mm]" in shown


def build_with(tmp_path: Path, change: dict[str, np.ndarray], speed: float = 40.0) -> MeasuredRun:
    """Build the run of the simulated sensors with some of them changed."""
    columns = simulated_motion(speed=speed)
    sensors = {n: x for n, x in sensor_readings(columns).items() if n[0] in "ae" or n == "roll_rate1"} | change
    units: dict[str, str | None] = {"v": "m/s"}
    units |= {name: {"a": "m/s^2", "e": "m", "r": "rad/s"}[name[0]] for name in sensors}
    path = write_map(tmp_path, "sensors:\n" + "".join(f"  {name}: {{channel: {name}}}\n" for name in sensors))
    recording = Recording("a", columns["t"], sensors | {"v": columns["v"]}, units)
    return build_measured_run(recording, load_map(path))


def test_clipping_is_named_as_clipping(tmp_path: Path) -> None:
    ay1 = sensor_readings(simulated_motion())["ay1"]
    run = build_with(tmp_path, {"ay1": np.clip(ay1, -0.5 * ay1.std(), 0.5 * ay1.std())})
    assert any(note.startswith("clipped: ay1 at ") for note in run.notes)
    assert any("ay1 is clipped, widen the range" in note for note in run.notes)
    assert not any("check the signs" in note for note in run.notes)
    save_run(tmp_path / "run.csv", run, run.notes)
    assert any("was clipped in the recording: ay1" in problem.message for problem in check([tmp_path / "run.csv"]))


def test_a_wrong_sign_is_named_as_a_wrong_sign(tmp_path: Path) -> None:
    run = build_with(tmp_path, {"ay2": -sensor_readings(simulated_motion())["ay2"]})
    assert any("check the signs and axes" in note for note in run.notes)
    assert not any("clipped" in note for note in run.notes)


@pytest.mark.parametrize("glitch", [655.35, -9999.0])
def test_a_glitch_of_the_speed_is_a_gap_and_is_not_smoothed_into_the_rows_around(tmp_path: Path, glitch: float) -> None:
    t = np.arange(8000) / 200.0
    v = np.where((t >= 15) & (t < 15.05), glitch, 40.0)
    recording = Recording("a", t, {"v": v, "yw": 1e-3 * np.sin(t)}, {"v": "m/s", "yw": "m"})
    run = build_measured_run(recording, load_map(write_map(tmp_path, "sensors: {yw: {channel: yw}}\n")))
    assert np.allclose(run.columns["v"], 40.0, rtol=0, atol=1e-9) and run.columns["t"].size == 7990
    assert np.allclose(run.columns["s"], 40 * run.columns["t"], rtol=0, atol=0.3)  # an interval at each end of the gap
    note = f"v: 10 rows of {glitch:g} m/s are gaps: a speed is from 0 to 170 m/s"
    assert [n for n in run.notes if n.startswith("v:")] == [note]
