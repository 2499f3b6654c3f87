"""Files that are easily read wrongly: a value never comes under another channel, time or unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from railui.api.recordings import import_recording
from railui.capture.formats import read_recordings, write_recording
from railui.capture.processing.recording import Recording
from railui.cli import cli
from railui.io.problems import FileProblems
from railui.io.table import read_table

T = np.arange(3000) / 200.0


def write_lines(path: Path, header: str, rows: list[str]) -> Path:
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def refusal(path: Path) -> str:
    with pytest.raises(FileProblems) as caught:
        read_recordings(path)
    return str(caught.value)


def test_a_separator_in_a_quoted_name_shifts_no_column(tmp_path: Path) -> None:
    rows = [f"{t},{k},{10 * k}" for k, t in enumerate(T[:9])]
    (recording,) = read_recordings(write_lines(tmp_path / "a.csv", '"t [s]","e1, left [m]","ay1 [m/s^2]"', rows))
    assert recording.units == {"t": "s", "e1, left": "m", "ay1": "m/s^2"}
    assert recording.channels["ay1"].tolist() == [10.0 * k for k in range(9)]


def test_a_header_of_another_length_than_the_rows_is_refused(tmp_path: Path) -> None:
    rows = [f"{t},{k},{10 * k}" for k, t in enumerate(T[:9])]
    message = refusal(write_lines(tmp_path / "a.csv", "t [s],extra [m],e1 [m],ay1 [m/s^2]", rows))
    assert "a.csv:1:1: has 4 cells, the rows below have 3" in message
    # R writes the numbers of the rows in a first column without a name
    message = refusal(
        write_lines(tmp_path / "b.csv", "e1 [m],ay1 [m/s^2]", [f"{k},{row}" for k, row in enumerate(rows)])
    )
    assert "has 2 cells, the rows below have 4" in message


def test_decimal_commas_in_quotes_are_read(tmp_path: Path) -> None:
    rows = [f'"{t:.4f}","{40 + t:.4f}"'.replace(".", ",").replace('","', '";"').replace(";", ",") for t in T[:9]]
    (recording,) = read_recordings(write_lines(tmp_path / "a.csv", '"t [s]","v [m/s]"', rows))
    assert np.allclose(recording.channels["v"], 40 + T[:9], atol=1e-4)


def test_commas_that_may_stand_between_thousands_are_refused(tmp_path: Path) -> None:
    rows = [f'{k},"{k + 1},500"' for k in range(9)]
    assert "between thousands" in refusal(write_lines(tmp_path / "a.csv", "t,v", rows))
    rows = [f"{k};1,5;1.5" for k in range(9)]
    assert "with a comma, '1,5', and with a point, '1.5'" in refusal(write_lines(tmp_path / "b.csv", "t;v;w", rows))


def test_words_are_skipped_by_name_and_a_stray_word_is_refused(tmp_path: Path) -> None:
    rows = [f"{k},RUN,{2 * k}" for k in range(9)]
    (recording,) = read_recordings(write_lines(tmp_path / "a.csv", "t [s],state,v [m/s]", rows))
    assert set(recording.channels) == {"t", "v"} and recording.notes == ["state holds text, such as 'RUN': skipped"]
    rows[5] = "5,RUN,OVER"
    assert "a.csv:7:1: v: 'OVER' is not a number" in refusal(
        write_lines(tmp_path / "a.csv", "t [s],state,v [m/s]", rows)
    )


def test_date_times_are_read_to_the_microsecond(tmp_path: Path) -> None:
    rows = [
        f"2026-11-22 23:59:59.{999990 + k:06d},1" if k < 10 else f"2026-11-23 00:00:00.{k - 10:06d},1"
        for k in range(20)
    ]
    (recording,) = read_recordings(write_lines(tmp_path / "a.csv", "Zeitstempel,v [m/s]", rows))
    assert np.allclose(np.diff(recording.t), 1e-6, atol=2.5e-7)  # a double at 1.8e9 s
    assert recording.t[10] == 1795392000.0


def test_unix_seconds_survive_the_import(tmp_path: Path) -> None:
    t = 1_700_000_000 + T
    v = 40 + np.sin(T)
    columns = {"t": t, "v": v, "yw": np.cumsum(np.cos(7 * T)) * 1e-6, "e1": 1e-3 * np.sin(9 * T)}
    write_recording(
        tmp_path / "a.csv",
        Recording("a", t, {n: columns[n] for n in ("v", "yw", "e1")}, {"v": "m/s", "yw": "m", "e1": "m"}),
    )
    (tmp_path / "map.yaml").write_text("speed: {channel: v}\nsensors: {yw: {channel: yw}, e1: {channel: e1}}\n")
    words = ["import", str(tmp_path / "a.csv"), "--map", str(tmp_path / "map.yaml"), "-o", str(tmp_path / "x.csv")]
    assert CliRunner().invoke(cli, words).exit_code == 0
    assert np.allclose(read_table(tmp_path / "x.csv").column("t"), t, rtol=0, atol=5e-7)
    assert CliRunner().invoke(cli, ["check", str(tmp_path / "x.csv")]).exit_code == 0


@pytest.mark.parametrize(
    ("fault", "said"),
    [("2,7", "a.csv:5:1: t: 2 a second time"), ("0.5,7", "a.csv:5:1: t: 0.5 after 2: rows are out of order")],
)
def test_repeated_and_unordered_times_are_refused_with_their_line(tmp_path: Path, fault: str, said: str) -> None:
    rows = ["0,1", "1,2", "2,3", fault, "3,4", "4,5"]
    assert said in refusal(write_lines(tmp_path / "a.csv", "t [s],v [m/s]", rows))


def test_a_row_without_a_time_is_a_gap(tmp_path: Path) -> None:
    rows = [f"{k},{k}" for k in range(9)]
    rows[4] = ",4"
    (recording,) = read_recordings(write_lines(tmp_path / "a.csv", "t [s],v [m/s]", rows))
    assert recording.t.tolist() == [0, 1, 2, 3, 5, 6, 7, 8] and "left out" in recording.notes[0]


def test_a_temperature_called_t_is_no_time(tmp_path: Path) -> None:
    rows = [f"{20 + k},{1000 * k}" for k in range(9)]
    (recording,) = read_recordings(write_lines(tmp_path / "a.csv", "T [K],time (msec)", rows))
    assert recording.t.tolist() == list(range(9))


def test_samples_marked_invalid_in_mdf_are_gaps(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    invalid = np.zeros(T.size, dtype=bool)
    invalid[100:160] = True
    e1 = np.where(invalid, 555.0, np.sin(T))
    with MDF(version="4.10") as file:
        file.append(
            [
                Signal(e1, T, name="e1", unit="mm", invalidation_bits=invalid),
                Signal(np.cos(T), T, name="v", unit="m/s"),
            ]
        )
        file.save(tmp_path / "a.mf4")
    (recording,) = read_recordings(tmp_path / "a.mf4")
    assert np.array_equal(np.isnan(recording.channels["e1"]), invalid)
    assert np.all(np.isfinite(recording.channels["v"]))
    assert "e1: 60 samples marked invalid by the recorder are gaps" in recording.notes


def test_a_hole_in_a_slower_channel_remains_one(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    slow = np.arange(750) / 50.0
    slow = slow[(slow < 6) | (slow >= 9)]
    with MDF(version="4.10") as file:
        file.append([Signal(np.cos(T), T, name="v", unit="m/s")])
        file.append([Signal(np.sin(2 * np.pi * 15 * slow), slow, name="rf", unit="rad/s")])
        file.save(tmp_path / "a.mf4")
    (recording,) = read_recordings(tmp_path / "a.mf4")
    rf = recording.channels["rf"]
    is_hole = (T > 6 - 0.02 + 1e-9) & (T < 9 - 1e-9) | (slow[-1] < T)
    assert np.array_equal(np.isnan(rf), is_hole)
    inner = ~is_hole & (T > 0.5) & (T < 14.3) & (abs(T - 7.5) > 2.2)
    # 15 Hz at 50 Hz: straight lines between the samples would be wrong by half
    assert np.max(np.abs(rf - np.sin(2 * np.pi * 15 * T))[inner]) < 1e-3
    assert any("rf has its own time stamps, every 0.02 s: resampled band-limited" in note for note in recording.notes)


def test_states_and_counters_are_not_interpolated(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    slow = np.arange(150) / 10.0
    gear = (np.arange(150) // 40).astype(np.uint8)
    with MDF(version="4.10") as file:
        file.append([Signal(np.cos(T), T, name="v", unit="m/s")])
        file.append([Signal(gear, slow, name="gear")])
        file.save(tmp_path / "a.mf4")
    (recording,) = read_recordings(tmp_path / "a.mf4")
    known = recording.channels["gear"][np.isfinite(recording.channels["gear"])]
    assert set(known) == {0.0, 1.0, 2.0, 3.0}


def test_hdf5_channels_of_several_lengths_are_joined_or_named(tmp_path: Path) -> None:
    import h5py

    slow = np.arange(750) / 50.0
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["ay1"] = T, np.cos(T)
        file["t_rf"], file["rf"] = slow * 1000, np.sin(slow)
        file["t_rf"].attrs["unit"] = "ms"
        file["lost"] = np.ones(77)
        file["rated"] = np.ones(1500)
        file["rated"].attrs["fs"] = 100.0
    (recording,) = read_recordings(tmp_path / "a.h5")
    assert set(recording.channels) == {"ay1", "rf", "rated"}
    assert np.nanmax(np.abs(recording.channels["rf"] - np.sin(T))) < 1e-2
    assert "lost has 77 values and no time of this length: left out" in recording.notes


def test_the_unit_of_a_universal_file_s_time_counts(tmp_path: Path) -> None:
    write_recording(tmp_path / "a.uff", Recording("a", T, {"ay1": np.sin(T)}, {"ay1": "m/s^2"}))
    data = (tmp_path / "a.uff").read_bytes()
    (tmp_path / "a.uff").write_bytes(data.replace(b"s".ljust(20) + b"\n", b"ms".ljust(20) + b"\n", 1))
    (recording,) = read_recordings(tmp_path / "a.uff")
    assert np.allclose(recording.t, T / 1000, rtol=1e-9)


def test_a_kilometrage_without_its_unit_is_not_taken_as_metres(tmp_path: Path) -> None:
    rows = "".join(f"{12.3 + 0.00025 * i:.5f},{i % 7}\n" for i in range(50))
    (tmp_path / "car.csv").write_text(f"km,yw [mm]\n{rows}")
    with pytest.raises(FileProblems, match=r"car\.csv: km: has no unit, .*write `km \[km\]`"):
        read_recordings(tmp_path / "car.csv")
    (tmp_path / "car.csv").write_text(f"km [km],yw [mm]\n{rows}")
    (recording,) = read_recordings(tmp_path / "car.csv")
    assert recording.interval == pytest.approx(0.25)


def test_an_import_does_not_write_into_the_recording(tmp_path: Path) -> None:
    path = tmp_path / "run_001.csv"
    text = "t [s],a [m/s^2]\n" + "".join(f"{0.01 * i:.2f},{i}\n" for i in range(50)) + "0.50,7"
    path.write_text(text)
    (tmp_path / "raw.bin").write_bytes(b"")
    path.chmod(0o444)
    (recording,) = read_recordings(tmp_path)
    assert recording.t.size == 50 and path.read_text() == text


def test_a_table_that_railui_writes_with_quotes_is_read(tmp_path: Path) -> None:
    (tmp_path / "front.csv").write_text('"a, b [m]",c [1]\n1,2\n"3",4\n')
    table = read_table(tmp_path / "front.csv")
    assert table.names == ("a, b", "c") and table.rows.tolist() == [[1, 2], [3, 4]]
    assert table.cell_position(1, "c") == (3, 5)


@pytest.mark.parametrize("name", ["run_a.csv", "run_a.csv.gz"])
@pytest.mark.parametrize("spelling", ["same", "other", "link", "json"])
def test_a_recording_is_not_overwritten_by_its_import(tmp_path: Path, name: str, spelling: str) -> None:
    write_recording(tmp_path / name, Recording("a", T, {"e1": np.sin(T)}, {"e1": "m"}))
    before = (tmp_path / name).read_bytes()
    (tmp_path / "sub").mkdir()
    (tmp_path / f"link_{name}").symlink_to(tmp_path / name)
    others = {"other": tmp_path / "sub" / ".." / name, "link": tmp_path / f"link_{name}"}
    out = str(others.get(spelling, tmp_path / name))
    result = CliRunner().invoke(
        cli, ["import", str(tmp_path / name), "--json" if spelling == "json" else "-o", out, "-q"]
    )
    assert result.exit_code == 2, result.output
    assert "would be overwritten, name another file to write" in result.output
    assert (tmp_path / name).read_bytes() == before
    with pytest.raises(FileProblems, match="would be overwritten"):
        import_recording(tmp_path / name, out=out)


def test_a_file_of_a_recording_directory_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "run_001.csv").write_text("t [s],a [m]\n" + "".join(f"{0.01 * i:.2f},{i}\n" for i in range(50)))
    (tmp_path / "raw.bin").write_bytes(b"")
    result = CliRunner().invoke(cli, ["import", str(tmp_path), "-o", str(tmp_path / "run_001.csv")])
    assert result.exit_code == 2 and "would be overwritten" in result.output


def test_a_channel_that_was_left_out_is_named_with_the_reason(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["v"] = T, 40 + 0 * T
        file["e1"], file["e2"], file["d1"], file["ayf"] = np.ones((3000, 2)), T + 1j, np.ones(77), ["a"] * 3000
    (tmp_path / "map.yaml").write_text(
        "speed: {channel: v, unit: m/s}\n"
        "sensors: {e1: {channel: e1}, e2: {channel: e2}, d1: {channel: d1}, ayf: {channel: ayf}}\n"
    )
    words = ["import", str(tmp_path / "a.h5"), "--map", str(tmp_path / "map.yaml"), "-o", str(tmp_path / "x.csv")]
    result = CliRunner().invoke(cli, words)
    assert result.exit_code == 2
    for name, reason in {
        "e1": "is an array of 3000 x 2",
        "e2": "holds no real numbers (complex128)",
        "d1": "has 77 values and no time of this length",
        "ayf": "holds no real numbers (object)",
    }.items():
        assert f"a.h5 has no channel '{name}': {name} {reason}: left out" in result.output


@pytest.mark.parametrize(
    ("factor", "start", "unit", "said"),
    [
        (1e3, 0.0, "ms", "t: has no unit, in seconds there would be a row every 5 s"),
        (1e6, 0.0, "us", "t: has no unit, in seconds there would be a row every 5000 s"),
        (1e3, 1.7e9, "ms", "t: is up to 1.7e+12 s, beyond any time since 1970"),
        (1e9, 1.7e9, "ns", "t: is up to 1.7e+18 s, beyond any time since 1970"),
    ],
)
@pytest.mark.parametrize("name", ["a.csv", "a.h5"])
def test_a_time_without_a_unit_that_is_hardly_in_seconds_is_refused(
    tmp_path: Path, name: str, factor: float, start: float, unit: str, said: str
) -> None:
    import h5py

    ticks = np.rint((start + T) * factor).astype(np.int64)
    if name == "a.csv":
        write_lines(tmp_path / name, "t,v [m/s]", [f"{t},40" for t in ticks])
    else:
        with h5py.File(tmp_path / name, "w") as file:
            file["t"], file["v"] = ticks, 40 + 0 * T
    message = refusal(tmp_path / name)
    assert said in message and "`t [ms]`, or its actual unit, in the header" in message
    (recording,) = read_recordings(tmp_path / name, f"t [{unit}]")
    assert recording.interval == pytest.approx(0.005, rel=1e-4)


def test_a_slow_logger_that_states_seconds_is_read(tmp_path: Path) -> None:
    (recording,) = read_recordings(
        write_lines(tmp_path / "a.csv", "t [s],v [m/s]", [f"{60 * k},{k}" for k in range(9)])
    )
    assert recording.interval == 60
    (recording,) = read_recordings(write_lines(tmp_path / "b.csv", "t,v [m/s]", [f"{k},{k}" for k in range(9)]))
    assert recording.interval == 1


@pytest.mark.parametrize("rate", ["nan", "inf", "1e-300", "1e300", "0", "-5"])
def test_a_rate_that_no_recorder_has_is_refused(tmp_path: Path, rate: str) -> None:
    path = write_lines(tmp_path / "a.csv", "v [m/s],e1 [m]", [f"{k},{k}" for k in range(9)])
    result = CliRunner().invoke(cli, ["import", str(path), "--rate", rate])
    assert result.exit_code == 2 and "Hz is no sampling rate, give 0.001 to 1e+07 Hz" in result.output
    with pytest.raises(FileProblems, match="is no sampling rate"):
        import_recording(path, rate=float(rate))


@pytest.mark.parametrize("name", ["a.csv", "a.mf4"])
def test_a_rate_is_not_used_where_the_file_has_its_own_times(tmp_path: Path, name: str) -> None:
    write_recording(tmp_path / name, Recording("a", T, {"v": 40 + 0 * T}, {"v": "m/s"}))
    (recording,) = read_recordings(tmp_path / name, rate=100.0)
    assert recording.interval == pytest.approx(0.005)
    assert recording.notes == ["the rate of 100 Hz is not used: the file has its own times"]
    path = write_lines(tmp_path / "b.csv", "v [m/s],e1 [m]", [f"{k},{k}" for k in range(9)])
    (recording,) = read_recordings(path, rate=100.0)
    assert recording.interval == pytest.approx(0.01) and recording.notes == []


def test_a_name_that_occurs_twice_gives_a_note_which_column_has_it(tmp_path: Path) -> None:
    rows = [f"{t},{k},{10 * k}" for k, t in enumerate(T[:9])]
    (recording,) = read_recordings(write_lines(tmp_path / "a.csv", "t [s],e1 [m],e1 [mm]", rows))
    assert recording.channels["e1"][1] == 1 and recording.channels["e1_3"][1] == 10
    assert recording.notes == ["e1 occurs several times: column 3 is called e1_3"]


def test_a_line_of_units_in_brackets_is_read(tmp_path: Path) -> None:
    rows = [f"{t},{k},{10 * k}" for k, t in enumerate(T[:9])]
    (recording,) = read_recordings(write_lines(tmp_path / "a.csv", "t,e1,ay1", ["[s],[mm],[m/s^2]", *rows]))
    assert recording.units == {"t": "s", "e1": "mm", "ay1": "m/s^2"}


def test_a_quoted_cell_with_letters_makes_a_column_of_text(tmp_path: Path) -> None:
    rows = [f'{t},"2, knee",1.5' if k == 3 else f"{t},{k},1.5" for k, t in enumerate(T[:9])]
    (recording,) = read_recordings(write_lines(tmp_path / "a.csv", "t [s],design,v [m/s]", rows))
    assert set(recording.channels) == {"t", "v"} and recording.channels["v"][0] == 1.5
    assert recording.notes == ["design holds text, such as '2, knee': skipped"]
