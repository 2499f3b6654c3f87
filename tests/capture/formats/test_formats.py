"""Files of others, and maps: what they hold becomes a run, whatever signs and units they have."""

from __future__ import annotations

import gzip
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from railui.capture.formats import delimited, read_recordings, write_recording
from railui.capture.processing.measured_run import measured_run
from railui.capture.processing.recording import Recording
from railui.capture.processing.sensor_map import load_map
from railui.cli import cli
from railui.cli.common import Invocation
from railui.cli.import_ import show_run
from railui.io.problems import FileProblems
from railui.runs.run import load_run
from railui.track.reader import load_track
from tests.capture.rides import BOGIE, RATE, read, ride

T = np.arange(400) / RATE
SERIES = {"acc_y": np.sin(20 * T), "way": 0.01 * np.cos(3 * T)}
UNITS: dict[str, str | None] = {"acc_y": "m/s^2", "way": "mm"}


@pytest.mark.parametrize("name", ["a.mf4", "a.uff", "a.h5", "a.mat"])
def test_what_is_written_in_a_format_is_read_from_it(tmp_path: Path, name: str) -> None:
    write_recording(tmp_path / name, Recording("a", T, SERIES, UNITS))
    (found,) = read_recordings(tmp_path / name)
    assert found.interval == pytest.approx(1 / RATE)
    for channel, x in SERIES.items():
        assert np.allclose(found.channels[channel], x, rtol=1e-5, atol=1e-7), channel
        assert found.units[channel] == UNITS[channel]


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("t [s],way [mm]\n0,1.5\n0.1,\n0.2,2.5\n0.3,3\n", "utf-8"),
        ("\ufefft [s];way [mm]\r\n0;1,5\r\n0,1;\r\n0,2;2,5\r\n0,3;3\r\n", "utf-8"),
        ("Messung Gerät 7\r\nt;way\r\ns;mm\r\n0,0;1,5\r\n0,1;NaN\r\n0,2;2,5\r\n0,3;3,0\r\n", "cp1252"),
        ("t (s)\tway (mm)\n0\t1.5\n0.1\t-\n0.2\t2.5\n0.3\t3\n", "utf-16"),
    ],
)
def test_csv_of_any_kind_is_read(tmp_path: Path, text: str, encoding: str) -> None:
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    (found,) = read_recordings(tmp_path / "a.csv")
    assert np.allclose(found.t, [0, 0.1, 0.2, 0.3]) and found.units["way"] == "mm"
    assert np.allclose(found.channels["way"], [1.5, np.nan, 2.5, 3.0], equal_nan=True)


def mapped_file(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "map.yaml"
    path.write_text(f"vehicle: {BOGIE}\n{text}")
    return path


def test_square_brackets_in_the_name_of_a_channel_are_text(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t;acc [/b] y;way :smile: [bold]x\n" + "".join(f"{i};1;2\n" for i in range(9)))
    told = CliRunner().invoke(cli, ["import", str(tmp_path / "a.csv")])
    assert told.exit_code == 0, told.output
    assert "acc [/b] y" in told.output and "way :smile: [bold]x" in told.output


def test_a_size_that_a_file_only_claims_is_refused(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("t", shape=(10**12,), dtype="f8", chunks=(1 << 16,))  # nothing of it is written
    with pytest.raises(FileProblems, match="claims 1000000000000 values"):
        read_recordings(tmp_path / "a.h5")


def test_a_file_that_is_too_large_uncompressed_is_refused_not_cut(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(delimited, "MOST_BYTES", 1000)
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(b"t;v\n" + b"0;1\n" * 1000))
    with pytest.raises(FileProblems, match="larger than 1000 bytes"):
        read_recordings(tmp_path / "a.csv.gz")


def test_conventions_signs_units_and_lags_come_out_in_railuis_own(tmp_path: Path) -> None:
    t = np.arange(round(20 * RATE)) / RATE
    true = np.sin(2 * np.pi * 1.5 * t)
    channels = {
        "left_up": -true / 9.80665,  # g, y to the left
        "turned": -true,  # its arrow points to the left
        "late": np.sin(2 * np.pi * 1.5 * (t - 0.012)),
        "offset": 1000 * true + 250.0,
        "v": np.full(t.size, 40.0),
        "yw": 1e-3 * np.sin(t),
    }
    units: dict[str, str | None] = {
        "left_up": "g",
        "turned": "m/s^2",
        "late": "m/s^2",
        "offset": "mm",
        "v": "m/s",
        "yw": "m",
    }
    text = """\
sensors:
  ay1: {channel: left_up, convention: ISO 8855, gravity: removed}
  ay2: {channel: turned, axis: -y, gravity: removed}
  ayf: {channel: late, delay: 12 ms, gravity: removed}
  d1: {channel: offset, offset: 250}
  yw: {channel: yw}
"""
    run = measured_run(Recording("a", t, channels, units), load_map(mapped_file(tmp_path, text)))
    for name in ("ay1", "ay2", "d1"):
        assert np.allclose(run.columns[name], true, atol=1e-9), name
    assert np.max(np.abs(run.columns["ayf"] - true)[10:-10]) < 1e-4


def test_every_fault_of_a_map_is_told_at_once_with_its_place(tmp_path: Path) -> None:
    text = "sensors:\n  ay1: {channel: a, axis: z}\n  ay3: {channel: b}\n  rf: {channel: c, noise: 3 mm}\n"
    text += "speed: {pulses: p}\n"
    path = mapped_file(tmp_path, text)
    with pytest.raises(FileProblems) as unknown:
        load_map(path)
    assert [p.key for p in unknown.value.problems] == ["sensors.ay3"] and "did you mean" in str(unknown.value)
    path = mapped_file(tmp_path, text.replace("ay3", "ay2"))
    with pytest.raises(FileProblems) as faults:
        load_map(path)
    assert {p.key for p in faults.value.problems} == {"sensors.ay1.axis", "sensors.rf.noise", "speed.radius"}
    assert all(p.line for p in faults.value.problems)


def test_a_channel_that_is_not_there_is_told_with_the_nearest(tmp_path: Path) -> None:
    path = mapped_file(tmp_path, "sensors: {ay1: {channel: box1}, e1: {channel: way}}\n")
    recording = Recording("a", T, {"box_1": T, "way": T}, {"box_1": "m/s^2", "way": "kN"})
    mapped = load_map(path)
    with pytest.raises(FileProblems) as faults:
        measured_run(recording, mapped)
    told = str(faults.value)
    assert "did you mean 'box_1'" in told and "way:" in told and "nothing tells the speed" in told


def test_gravity_on_a_lateral_axis_is_doubted(tmp_path: Path) -> None:
    columns = ride()
    q = read(columns)
    names = ("ay1", "ay2", "e1_right", "e1_left", "e2_right", "e2_left", "roll_rate1")
    channels = {name: q[name] for name in names} | {"v": columns["v"]}
    channels["ay1"] = channels["ay1"] + 9.81
    units: dict[str, str | None] = {n: "m" for n in names} | {
        "ay1": "m/s^2",
        "ay2": "m/s^2",
        "roll_rate1": "rad/s",
        "v": "m/s",
    }
    path = mapped_file(tmp_path, "sensors:\n" + "".join(f"  {n}: {{channel: {n}}}\n" for n in names))
    run = measured_run(Recording("a", columns["t"], channels, units), load_map(path))
    assert any("ay1" in note and "gravity is on its axis" in note for note in run.notes)


def test_a_vehicle_that_stands_before_it_runs_is_taken_from_where_it_runs(tmp_path: Path) -> None:
    columns = ride()
    sensors = {name: x for name, x in read(columns).items() if name[0] in "ae" or name == "roll_rate1"}
    speed = np.where(columns["t"] < columns["t"][0] + 12.0, 0.0, columns["v"])
    units: dict[str, str | None] = {"v": "m/s"}
    units |= {name: {"a": "m/s^2", "e": "m", "r": "rad/s"}[name[0]] for name in sensors}
    path = mapped_file(tmp_path, "sensors:\n" + "".join(f"  {name}: {{channel: {name}}}\n" for name in sensors))
    run = measured_run(Recording("a", columns["t"], sensors | {"v": speed}, units), load_map(path))
    assert "12 s at a standstill are left out" in run.notes
    assert run.columns["t"][0] >= columns["t"][0] + 12.0 and np.all(run.columns["v"] > 1.0)
    assert run.quality is not None and run.quality.correlation > 0.9


def test_a_recording_car_becomes_a_track(tmp_path: Path) -> None:
    s = np.arange(0, 500, 0.25)
    rows = "\r\n".join(
        f"{x:.2f};{2 + np.sin(x):.4f};{np.sin(x):.4f};{3.0:.1f};{1438.0:.1f}".replace(".", ",") for x in s
    )
    header = "s [m];align_r [mm];align_l [mm];cross [mm];gauge [mm]\r\n"
    (tmp_path / "car.csv").write_bytes((header + rows + "\r\n").encode("cp1252"))
    text = """\
convention: EN 13848
sensors:
  alignment_right: {channel: align_r}
  alignment_left: {channel: align_l}
  cross_level: {channel: cross}
  gauge: {channel: gauge}
"""
    (tmp_path / "map.yaml").write_text(text)
    words = [
        "import",
        str(tmp_path / "car.csv"),
        "--map",
        str(tmp_path / "map.yaml"),
        "-o",
        str(tmp_path / "track.csv"),
    ]
    result = CliRunner().invoke(cli, words)
    assert result.exit_code == 0, result.output
    track = load_track(tmp_path / "track.csv")
    assert np.allclose(track.yw, 1e-3 * (1 + np.sin(s)), atol=1e-7)
    assert np.allclose(track.phiw, 0.003 / 1.5) and np.allclose(track.gauge, 0.003)


def test_a_bench_test_becomes_a_run_of_a_rig(tmp_path: Path) -> None:
    write_recording(tmp_path / "bench.mf4", Recording("a", T, SERIES, UNITS))
    (tmp_path / "map.yaml").write_text("sensors: {u: {channel: acc_y}, z: {channel: way}}\n")
    words = [
        "import",
        str(tmp_path / "bench.mf4"),
        "--map",
        str(tmp_path / "map.yaml"),
        "-o",
        str(tmp_path / "r.csv.gz"),
    ]
    result = CliRunner().invoke(cli, words)
    assert result.exit_code == 0, result.output
    run = load_run(tmp_path / "r.csv.gz")
    assert run.kind == "rig" and run.units["z"] == "mm" and np.allclose(run.columns["z"], SERIES["way"], atol=1e-9)


def test_a_draft_names_every_channel(tmp_path: Path) -> None:
    write_recording(tmp_path / "bench.h5", Recording("a", T, SERIES, UNITS))
    result = CliRunner().invoke(cli, ["import", str(tmp_path / "bench.h5"), "--draft", str(tmp_path / "map.yaml")])
    text = (tmp_path / "map.yaml").read_text()
    assert result.exit_code == 0 and all(name in text for name in SERIES) and "one of ay1, ay2, ayf" in text


def test_the_table_of_rail_positions_names_its_units(capsys: pytest.CaptureFixture[str]) -> None:
    quality = SimpleNamespace(valid=(3.0, 70.0), lag=0.01, bands=[(3.0, 25.0, 7e-4, 1e-4)])
    run = SimpleNamespace(columns={"t": T}, counts={"rows": len(T), "gaps": 0}, notes=(), quality=quality, natural=2.0)
    show_run(Invocation(), "run.csv.gz", run)  # type: ignore[arg-type]
    shown = capsys.readouterr().out
    assert "wavelengths [m]" in shown and "sd yw [mm]" in shown and "difference of both wheelsets [mm]" in shown
