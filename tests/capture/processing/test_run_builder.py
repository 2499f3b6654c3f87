"""Recordings of a bogie and of a test rig to runs."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from railui.arrays import FloatArray
from railui.capture.formats import write_recording
from railui.capture.processing.measured_run import MeasuredRun, save_run
from railui.capture.processing.recording import Recording
from railui.capture.processing.run_builder import build_measured_run
from railui.capture.processing.sensor_map import load_map
from railui.cli import cli
from railui.cli.import_ import show_imported_run
from railui.cli.invocation import Invocation
from railui.documents.check import check
from railui.io.problems import FileProblems
from railui.runs.run import load_run
from tests.capture.simulated_runs import SERIES, UNITS, T, sensor_readings, simulated_motion, write_map

T4 = np.arange(4000) / 200.0  # s

T4 = np.arange(4000) / 200.0  # s


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


def test_a_unit_of_the_map_that_contradicts_the_file_gives_a_note(tmp_path: Path) -> None:
    t = T4
    recording = Recording(
        "a", t, {"v": 40 + 0 * t, "yw": np.sin(t), "e1": np.cos(t)}, {"v": "m/s", "yw": "m", "e1": "m"}
    )
    text = "speed: {channel: v, unit: m/s}\nsensors: {yw: {channel: yw, unit: mm}, e1: {channel: e1, unit: m}}\n"
    run = build_measured_run(recording, load_map(write_map(tmp_path, text)))
    notes = [note for note in run.notes if "the unit" in note]
    assert notes == ["yw: the unit mm of the map is used instead of m, which the file states"]
    assert np.allclose(run.columns["yw"], 1e-3 * np.sin(T4))


def test_a_speed_without_a_unit_is_refused_as_that_of_a_sensor(tmp_path: Path) -> None:
    t = T4
    recording = Recording("a", t, {"v": 144 + 0 * t, "yw": 1e-3 * np.sin(t)}, {"v": None, "yw": "m"})
    for speed in ("", "speed: {channel: v}\n"):
        sensor_map = load_map(write_map(tmp_path, f"{speed}sensors: {{yw: {{channel: yw}}}}\n"))
        with pytest.raises(FileProblems, match=r"v: has no unit, write `speed: \{channel: v, unit: m/s\}`"):
            build_measured_run(recording, sensor_map)
    text = "speed: {channel: v, unit: km/h}\nsensors: {yw: {channel: yw}}\n"
    assert build_measured_run(recording, load_map(write_map(tmp_path, text))).columns["v"][0] == pytest.approx(40)


@pytest.mark.parametrize(("delay", "kept"), [(0.5, slice(0, 3900)), (-0.5, slice(100, 4000)), (0.012, slice(0, 4000))])
def test_rows_that_a_delay_leaves_without_a_value_are_left_out(tmp_path: Path, delay: float, kept: slice) -> None:
    t = T4
    channels = {"v": 40 + 0 * t, "yw": 1e-3 * np.sin(t), "e1": 1e-3 * np.sin(3 * (t - delay))}
    recording = Recording("a", t, channels, {"v": "m/s", "yw": "m", "e1": "m"})
    text = f"sensors: {{yw: {{channel: yw}}, e1: {{channel: e1, delay: {delay} s}}}}\n"
    run = build_measured_run(recording, load_map(write_map(tmp_path, text)))
    assert np.allclose(run.columns["t"], t[kept])
    assert np.allclose(run.columns["e1"][:-3], 1e-3 * np.sin(3 * t[kept])[:-3], atol=1e-7)
    assert any("a delay leaves them no value" in note for note in run.notes) == (abs(delay) > 0.05)


@pytest.mark.parametrize("delay", ["5 s", "1 h", "-2 s", "1e9"])
def test_a_delay_that_no_sensor_has_is_refused(tmp_path: Path, delay: str) -> None:
    with pytest.raises(FileProblems, match=r"sensors\.e1\.delay: .* give at (most|least) -?1 s"):
        load_map(write_map(tmp_path, f"sensors: {{e1: {{channel: e1, delay: {delay}}}}}\n"))


@pytest.mark.parametrize(
    ("columns", "speed", "said"),
    [
        ({"v": -40.0}, "{channel: v}", "v: 4000 rows of -40 m/s are gaps"),
        ({"v": 0.0}, "{channel: v}", "20 s at a standstill are ignored: v < 1 m/s"),
        ({"v": np.nan}, "{channel: v}", "no row has a value of v"),
        ({"yw": np.nan}, "{channel: v}", "no row has a value of yw"),
        ({"n": np.floor(800 * T4) % 4096}, "{pulses: n, per_turn: 60, radius: 0.46 m}", "the counter n falls from 409"),
    ],
)
def test_a_recording_without_a_segment_names_the_channel_and_the_cause(
    tmp_path: Path, columns: dict[str, FloatArray | float], speed: str, said: str
) -> None:
    channels = {"v": 40 + 0 * T4, "yw": 1e-3 * np.sin(T4)} | {name: x + 0 * T4 for name, x in columns.items()}
    recording = Recording("a", T4, channels, {"v": "m/s", "yw": "m"})
    text = f"speed: {speed}\nsensors: {{yw: {{channel: yw, unit: m}}}}\n"
    with pytest.raises(FileProblems, match="no segment is long enough") as caught:
        build_measured_run(recording, load_map(write_map(tmp_path, text)))
    assert said in str(caught.value)
