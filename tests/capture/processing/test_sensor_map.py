"""Sensor maps: problems of a file, conversion to SI and railui's signs, draft."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from railui.capture.formats import write_recording
from railui.capture.processing.recording import Recording
from railui.capture.processing.run_builder import build_measured_run
from railui.capture.processing.sensor_map import load_map
from railui.cli import cli
from railui.io.problems import FileProblems
from tests.capture.simulated_runs import RATE, SERIES, UNITS, T, write_map


def test_conventions_signs_units_and_delays_are_converted(tmp_path: Path) -> None:
    t = np.arange(round(20 * RATE)) / RATE
    true = np.sin(2 * np.pi * 1.5 * t)
    channels = {
        "left_up": -true / 9.80665,  # g, y to the left
        "turned": -true,  # the sensor points to the left
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
    run = build_measured_run(Recording("a", t, channels, units), load_map(write_map(tmp_path, text)))
    for name in ("ay1", "ay2", "d1"):
        assert np.allclose(run.columns[name], true, atol=1e-9), name
    assert np.max(np.abs(run.columns["ayf"] - true)[10:-10]) < 1e-4


def test_offset_with_a_unit_is_converted_to_the_unit_of_the_channel(tmp_path: Path) -> None:
    t = np.arange(round(20 * RATE)) / RATE
    true = np.sin(2 * np.pi * 1.5 * t)
    channels = {"mm": 1e3 * true + 2.0, "g": true / 9.80665 + 1.0, "v": np.full(t.size, 40.0), "yw": 1e-3 * np.sin(t)}
    units: dict[str, str | None] = {"mm": "mm", "g": "g", "v": "m/s", "yw": "m"}
    recording = Recording("a", t, channels, units)
    for d1, ay1 in (("2 mm", "1 g"), ("0.002 m", "9.80665 m/s^2"), ("2", "1")):
        sensors = f"d1: {{channel: mm, offset: {d1}}}\n  ay1: {{channel: g, offset: {ay1}, gravity: removed}}"
        text = f"sensors:\n  {sensors}\n  yw: {{channel: yw}}\n"
        run = build_measured_run(recording, load_map(write_map(tmp_path, text)))
        assert np.allclose(run.columns["d1"], true, atol=1e-9), d1
        assert np.allclose(run.columns["ay1"], true, atol=1e-9), ay1
    with pytest.raises(FileProblems, match=r"sensors\.d1\.offset"):
        load_map(write_map(tmp_path, "sensors:\n  d1: {channel: mm, offset: 2 V}\n  yw: {channel: yw}\n"))
    rig = Recording("rig", t, {"volts": 1e-3 * true + 0.002}, {"volts": "V"})
    run = build_measured_run(rig, load_map(write_map(tmp_path, "sensors: {z: {channel: volts, offset: 2 mV}}\n")))
    assert np.allclose(run.columns["z"], 1e-3 * true, atol=1e-9)
    with pytest.raises(FileProblems, match=r"sensors\.z\.channel"):
        build_measured_run(rig, load_map(write_map(tmp_path, "sensors: {z: {channel: volts, offset: 2 mm}}\n")))


def test_every_problem_of_a_map_is_reported_with_its_line(tmp_path: Path) -> None:
    text = "sensors:\n  ay1: {channel: a, axis: z}\n  ay3: {channel: b}\n  rf: {channel: c, noise: 3 mm}\n"
    text += "speed: {pulses: p}\n"
    path = write_map(tmp_path, text)
    with pytest.raises(FileProblems) as unknown:
        load_map(path)
    assert [p.key for p in unknown.value.problems] == ["sensors.ay3"] and "did you mean" in str(unknown.value)
    path = write_map(tmp_path, text.replace("ay3", "ay2"))
    with pytest.raises(FileProblems) as faults:
        load_map(path)
    assert {p.key for p in faults.value.problems} == {"sensors.ay1.axis", "sensors.rf.noise", "speed.radius"}
    assert all(p.line for p in faults.value.problems)


def test_the_geometry_of_a_coach_is_that_of_its_leading_bogie(tmp_path: Path) -> None:
    designs = Path(__file__).parents[3] / "designs"
    sensors = "sensors: {yw: {channel: a}}\n"
    (tmp_path / "coach.yaml").write_text(f"vehicle: {designs / 'manchester_coach.yaml'}\n{sensors}")
    geometry = load_map(tmp_path / "coach.yaml").geometry
    assert geometry is not None and (geometry.half_gauge, geometry.rolling_radius) == (0.75, 0.46)
    assert geometry.half_wheelbase == pytest.approx(1.28) and geometry.roll == (0.05, 0.05)
    (tmp_path / "wheelset.yaml").write_text(f"vehicle: {designs / 'roller_rig.yaml'}\n{sensors}")
    with pytest.raises(FileProblems, match="has a single wheelset, the rail position needs two"):
        load_map(tmp_path / "wheelset.yaml")


def test_cross_level_in_an_angle_points_to_the_quantity_of_that_unit(tmp_path: Path) -> None:
    path = write_map(tmp_path, "sensors: {cross_level: {channel: cant, unit: mrad}}\n")
    with pytest.raises(FileProblems, match="phiw: cross-level as an angle"):
        load_map(path)


def test_an_angle_in_mm_points_to_the_cross_level_as_a_height(tmp_path: Path) -> None:
    path = write_map(tmp_path, "sensors: {phiw: {channel: cant, unit: mm}}\n")
    with pytest.raises(FileProblems, match="name the quantity cross_level: cross-level as a height difference"):
        load_map(path)


def test_the_noise_of_a_cross_level_and_of_alignments_is_that_of_the_track_columns(tmp_path: Path) -> None:
    """0.03 mm over 1.5 m is 0.02 mrad; the mean of two rails of 0.03 and 0.04 mm has 0.025 mm."""
    text = "speed: {channel: v}\nsensors:\n  alignment_right: {channel: r, noise: 0.03 mm}\n"
    text += "  alignment_left: {channel: l, noise: 0.04 mm}\n  cross_level: {channel: c, noise: 0.03 mm}\n"
    text += "  gauge: {channel: g, noise: 0.05 mm}\n  e1: {channel: e, noise: 0.05 mm}\n"
    t = np.arange(round(30 * RATE)) / RATE
    wave = np.sin(t)
    columns = {"r": wave, "l": wave, "c": wave, "g": 0.1 * wave, "e": wave, "v": np.full(t.size, 40.0)}
    recording = Recording("a", t, columns, {name: "mm" for name in columns} | {"v": "m/s"})
    noise = build_measured_run(recording, load_map(write_map(tmp_path, text))).noise
    expected = {"yw": 2.5e-5, "phiw": 2e-5, "gauge": 5e-5, "e1": 5e-5}
    assert {name: noise[name] for name in expected} == pytest.approx(expected)


def test_missing_channel_is_reported_with_the_nearest_name(tmp_path: Path) -> None:
    path = write_map(tmp_path, "sensors: {ay1: {channel: box1}, e1: {channel: way}}\n")
    recording = Recording("a", T, {"box_1": T, "way": T}, {"box_1": "m/s^2", "way": "kN"})
    sensor_map = load_map(path)
    with pytest.raises(FileProblems) as faults:
        build_measured_run(recording, sensor_map)
    message = str(faults.value)
    assert "did you mean 'box_1'" in message and "way:" in message and "the speed is not given" in message


def test_draft_contains_every_channel(tmp_path: Path) -> None:
    write_recording(tmp_path / "bench.h5", Recording("a", T, SERIES, UNITS))
    result = CliRunner().invoke(cli, ["import", str(tmp_path / "bench.h5"), "--draft", str(tmp_path / "map.yaml")])
    text = (tmp_path / "map.yaml").read_text()
    assert result.exit_code == 0 and all(name in text for name in SERIES) and "one of ay1, ay2, ayf" in text
    assert "{channel: acc_y, gravity: raw}" in text and "{channel: way}" in text  # gravity is of accelerometers


def test_the_draft_of_channels_without_a_known_unit_names_the_key(tmp_path: Path) -> None:
    rows = [f"{0.005 * i:.3f},{i % 7},{i % 5},{i % 3}" for i in range(400)]
    (tmp_path / "a.csv").write_text("\n".join(["t [s],x,acc [m/s2],y [furlong]", *rows]))
    result = CliRunner().invoke(cli, ["import", str(tmp_path / "a.csv"), "--draft", str(tmp_path / "map.yaml")])
    text = (tmp_path / "map.yaml").read_text()
    assert "without a unit: x; add the key `unit:`" in result.output + result.stderr
    assert "{channel: acc, gravity: raw}    # one of ay1" in text
    assert "y [furlong]: no quantity has this unit; where it is misspelt, `NAME: {channel: y, unit: UNIT}`" in text


def test_draft_names_the_channel_of_the_speed_by_its_unit(tmp_path: Path) -> None:
    lines = ["Zeit;Geschwindigkeit;Temp", "ms;km/h;°C", *(f"{5 * i};{136 + i / 7:.3f};21,5" for i in range(40))]
    (tmp_path / "drive.csv").write_text("\n".join(lines).replace(".", ","), "latin-1")
    CliRunner().invoke(cli, ["import", str(tmp_path / "drive.csv"), "--draft", str(tmp_path / "map.yaml")])
    text = (tmp_path / "map.yaml").read_text()
    assert "# speed: {channel: Geschwindigkeit}" in text and "Temp [°C]: no quantity has this unit" in text
