"""Runs: columns in SI, segments, positions of faults."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from railui.io import table, table_cells
from railui.io.problems import Problem
from railui.runs.run import Run, load_run

ProblemsOf = Callable[[Callable[[], object]], list[Problem]]
Columns = Callable[..., dict[str, np.ndarray]]
Csv = Callable[..., str]
COLUMNS_PAGE = (Path(__file__).parents[2] / "docs" / "columns.md").read_text("utf-8")


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str | bytes], Path]:
    """Writes a table and returns its path."""

    def write(text: str | bytes, name: str = "run.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return write


Written = Callable[[str | bytes], Path]


def lines(text: str) -> list[str]:
    """The lines of a table, the header first."""
    return text.rstrip("\n").split("\n")


def test_a_whole_run_is_one_segment(written: Written, columns: Columns, as_csv: Csv) -> None:
    run = load_run(written(as_csv(columns())))
    assert (run.kind, run.rate, run.segments, len(run)) == ("bogie", 50.0, (slice(0, 1000),), 1000)
    assert run.responses == ("e1", "ay1") and run.coach_forces == () and run.unknown_columns == ()
    assert run.counts["used"] == 1000 and run.counts["gaps"] == 0


def test_units_become_si(written: Written, columns: Columns, as_csv: Csv) -> None:
    recorded = columns()
    text = as_csv(recorded).replace("v [m/s]", "v [km/h]").replace("yw [m]", "yw [mm]").replace("t [s]", "t [ms]")
    text = text.replace("e1 [m]", "e1 [µm]")
    rows = [x.split(",") for x in lines(text)]
    for row in rows[1:]:
        row[0] = f"{1000 * float(row[0]):.9g}"
    run = load_run(written("\n".join(",".join(row) for row in rows)))
    assert run.rate == 50.0
    assert run.columns["v"][0] == pytest.approx(40 / 3.6)
    np.testing.assert_allclose(run.columns["yw"], recorded["yw [m]"] * 1e-3, rtol=1e-8)
    np.testing.assert_allclose(run.columns["e1"], recorded["e1 [m]"] * 1e-6, rtol=1e-8)
    assert run.units["yw"] == "mm"


def test_absent_columns_are_filled_and_noted(written: Written, columns: Columns, as_csv: Csv) -> None:
    run = load_run(written(as_csv(columns())))
    np.testing.assert_allclose(run.columns["s"], 40.0 * run.columns["t"], atol=1e-9)
    assert not run.columns["phiw"].any() and not run.columns["gauge"].any()
    assert run.notes == (
        "phiw is absent: taken as 0",
        "gauge is absent: taken as 0",
        "s is absent: the integral of v",
    )


def test_unknown_columns_are_listed_but_not_used(written: Written, columns: Columns, as_csv: Csv) -> None:
    recorded = columns() | {"door [1]": np.full(1000, np.nan), "e9": np.ones(1000)}
    run = load_run(written(as_csv(recorded)))
    assert run.unknown_columns == ("door", "e9")
    assert np.all(run.unknown_values["e9"] == 1) and run.counts["used"] == 1000


def test_missing_columns_and_wrong_units_are_reported_at_the_header(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    text = "# tour 3\n" + as_csv(columns()).replace("yw [m]", "yW [m]").replace("ay1 [m/s^2]", "ay1 [m/s]").replace(
        "e1 [m]", "e1"
    )
    found = problems_of(lambda: load_run(written(text)))
    assert [(p.line, p.column, p.key) for p in found] == [(2, 1, "yw"), (2, 22, "e1"), (2, 25, "ay1")]
    assert found[0].remedy == "did you mean 'yW'?"
    assert found[1].remedy == "write that of its numbers, such as `e1 [m]`"
    assert "the unit m/s does not fit the acceleration of the leading axle boxes, expected in m/s^2" in found[2].message
    assert found[2].remedy.startswith("convert the numbers") and "`sensors: {ay1: {unit: UNIT}}`" in found[2].remedy
    assert "ay1 [m/s^2]" not in found[2].remedy  # the numbers are none


@pytest.mark.parametrize(("unit", "factor"), [("g", 9.80665), ("mg", 9.80665e-3)])
def test_an_acceleration_may_be_in_g(written: Written, columns: Columns, as_csv: Csv, unit: str, factor: float) -> None:
    recorded = columns()
    run = load_run(written(as_csv(recorded).replace("ay1 [m/s^2]", f"ay1 [{unit}]")))
    np.testing.assert_allclose(run.columns["ay1"], factor * recorded["ay1 [m/s^2]"], rtol=1e-8)
    assert run.units["ay1"] == unit


def test_the_gram_is_no_unit_of_a_displacement(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    [problem] = problems_of(lambda: load_run(written(as_csv(columns()).replace("e1 [m]", "e1 [g]"))))
    assert "the unit g does not fit the leading wheelset" in problem.message


def test_a_cross_level_as_a_height_is_to_be_divided_by_its_base(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    recorded = columns() | {"phiw [mm]": np.sin(columns()["t [s]"])}
    [problem] = problems_of(lambda: load_run(written(as_csv(recorded))))
    assert problem.key == "phiw" and "expected in rad" in problem.message
    assert "1.5 m" in problem.remedy and "`cross_level`" in problem.remedy and "[rad]" not in problem.remedy


def test_a_run_without_any_response_is_rejected(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    text = as_csv({k: v for k, v in columns().items() if k[:2] not in ("e1", "ay")})
    assert "no response is measured" in problems_of(lambda: load_run(written(text)))[0].message
    assert load_run(written(text), responses=False).responses == ()


# what ends a stretch


def usable(run: Run) -> list[tuple[int, int]]:
    return [(s.start, s.stop) for s in run.segments]


def test_missing_rows_end_a_segment(written: Written, columns: Columns, as_csv: Csv) -> None:
    recorded = {k: np.delete(v, slice(700, 710)) for k, v in columns(30.0).items()}
    run = load_run(written(as_csv(recorded)))
    assert usable(run) == [(0, 700), (700, 1490)]
    assert (run.counts["gaps"], run.counts["missing_rows"]) == (1, 10)


@pytest.mark.parametrize("cell", ["", "nan", "NaN", "NA", " "])
def test_an_empty_cell_ends_a_segment(cell: str, written: Written, columns: Columns, as_csv: Csv) -> None:
    rows = lines(as_csv(columns(30.0)))
    row = rows[701].split(",")
    rows[701] = ",".join([*row[:3], cell, *row[4:]])
    run = load_run(written("\n".join(rows)))
    assert usable(run) == [(0, 700), (701, 1500)]
    assert run.counts["nan_rows"] == 1


def test_empty_cells_at_both_ends_of_a_row_are_read(written: Written, columns: Columns, as_csv: Csv) -> None:
    rows = lines(as_csv(columns(30.0)))
    rows[701] = rows[701].rsplit(",", 1)[0] + ","
    rows[702] = "," + rows[702].split(",", 1)[1]
    run = load_run(written("\r\n".join(rows)))
    assert usable(run) == [(0, 700), (701, 1499)]  # a row without time is a missing row
    assert (run.counts["gaps"], run.counts["nan_rows"]) == (1, 2)


def test_a_channel_stuck_for_a_second_ends_a_segment(written: Written, columns: Columns, as_csv: Csv) -> None:
    recorded = columns(30.0)
    recorded["e1 [m]"][700:750] = 1e-3
    recorded["ay1 [m/s^2]"][100:149] = 0.5  # one sample short of a second
    run = load_run(written(as_csv(recorded)))
    assert usable(run) == [(0, 700), (750, 1500)]
    assert (run.counts["stuck"], run.counts["stuck_rows"]) == (1, 50)


def test_a_constant_speed_is_not_stuck(written: Written, columns: Columns, as_csv: Csv) -> None:
    assert load_run(written(as_csv(columns()))).counts["stuck"] == 0


def test_segments_under_ten_seconds_are_counted_not_used(written: Written, columns: Columns, as_csv: Csv) -> None:
    recorded = {k: np.delete(v, [499, 700]) for k, v in columns(30.0).items()}
    run = load_run(written(as_csv(recorded)))
    assert usable(run) == [(699, 1498)]
    assert (run.counts["short_stretches"], run.counts["unused_rows"], run.counts["stretches"]) == (2, 699, 1)


def test_ten_seconds_are_enough(written: Written, columns: Columns, as_csv: Csv) -> None:
    assert usable(load_run(written(as_csv(columns(10.0))))) == [(0, 500)]


def test_a_run_without_any_usable_segment_is_rejected(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    found = problems_of(lambda: load_run(written(as_csv(columns(9.9)))))
    assert "no segment of 10 s is without interruption" in found[0].message


def test_standing_still_is_not_used(written: Written, columns: Columns, as_csv: Csv) -> None:
    recorded = columns(30.0)
    recorded["v [m/s]"][:200] = 0.0
    run = load_run(written(as_csv(recorded)))
    assert usable(run) == [(200, 1500)] and run.counts["standing_rows"] == 200


def test_a_dead_channel_is_left_out_and_named(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    run_columns = columns() | {"d1 [m]": np.full(1000, 2e-3), "d2 [m]": np.full(1000, np.nan)}
    run = load_run(written(as_csv(run_columns)))
    assert run.responses == ("e1", "ay1")
    assert run.notes[:2] == ("d1 is 0.002 throughout: not used", "d2 has no value: not used")
    dead = columns() | {"yw [m]": np.full(1000, 1e-3)}
    assert problems_of(lambda: load_run(written(as_csv(dead))))[0].key == "yw"


def test_what_interrupts_a_run_is_warned_of_with_its_line_and_time(
    written: Written, columns: Columns, as_csv: Csv
) -> None:
    rows = columns(seconds=60.0)
    rows["t [s]"][2000:] += 30.0
    rows["v [m/s]"][100:110] = 0.0
    rows["e1 [m]"][700:800] = rows["e1 [m]"][700]
    rows["ay1 [m/s^2]"][1500:1503] = np.nan
    rows["yw [m]"][1500:1503] = np.nan
    rows["d1 [m]"] = np.full(3000, np.nan)
    found = {p.key: p for p in load_run(written(as_csv(rows))).warnings}
    assert {key: p.line for key, p in found.items()} == {"d1": 1, "t": 2002, "yw": 1502, "v": 102, "e1": 702}
    assert found["t"].message == "has a gap of 30.02 s from 39.98 s on"
    assert found["yw"].message == "and ay1 have no value in 3 rows, first at 30 s"
    assert found["v"].message == "is 0 or less in 10 rows, first at 2 s"
    assert found["e1"].message.startswith("is stuck once, at ") and found["e1"].message.endswith("2 s from 14 s on")
    assert found["d1"].message == "has no value" and all(p.remedy for p in found.values())


def test_a_track_of_zeros_is_a_straight_line(written: Written, columns: Columns, as_csv: Csv) -> None:
    flat = columns() | {"yw [m]": np.zeros(1000), "gauge [m]": np.zeros(1000)}
    assert load_run(written(as_csv(flat))).counts["used"] == 1000


# time


def test_rows_out_of_order_are_reported_with_their_line(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    rows = lines("# a\n" + as_csv(columns()))
    rows[300], rows[301] = rows[301], rows[300]
    found = problems_of(lambda: load_run(written("\n".join(rows))))
    assert (found[0].line, found[0].column, found[0].key) == (302, 1, "t")
    assert "out of order" in found[0].message


def test_a_repeated_time_stamp_is_reported_with_its_line(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    rows = lines(as_csv(columns()))
    rows.insert(401, rows[400])
    found = problems_of(lambda: load_run(written("\n".join(rows))))
    assert (found[0].line, found[0].key) == (402, "t") and "a second time" in found[0].message


def test_an_uneven_interval_is_reported_with_its_line(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    late = columns()
    late["t [s]"][500] += 0.011 * 0.02
    found = problems_of(lambda: load_run(written(as_csv(late))))
    assert (found[0].line, found[0].key) == (502, "t") and "1 more rows" in found[0].message
    slightly = columns()
    slightly["t [s]"][500] += 0.008 * 0.02
    assert load_run(written(as_csv(slightly))).rate == 50.0


def test_distance_that_does_not_increase_is_reported_with_its_line(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    rows = columns()
    rows["s [m]"] = 40 * rows["t [s]"]
    rows["s [m]"][501] = rows["s [m]"][500]
    found = problems_of(lambda: load_run(written(as_csv(rows))))
    assert (found[0].line, found[0].key) == (503, "s")


def test_a_distance_that_contradicts_the_speed_is_noted(written: Written, columns: Columns, as_csv: Csv) -> None:
    rows = columns()
    rows["s [m]"] = 44 * rows["t [s]"]
    assert any("check both" in note for note in load_run(written(as_csv(rows))).notes)


@pytest.mark.parametrize("factor", [60, 1000])
def test_a_time_too_slow_for_a_vehicle_is_reported(
    factor: float, written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    rows = columns()
    rows["t [s]"] *= factor
    (found,) = problems_of(lambda: load_run(written(as_csv(rows))))
    assert (found.line, found.key) == (1, "t") and "`t [ms]`" in found.remedy


def test_a_time_too_short_for_a_segment_is_reported(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    rows = columns()
    rows["t [s]"] /= 60
    (found,) = problems_of(lambda: load_run(written(as_csv(rows))))
    assert "1000 rows at 3000 Hz last 0.333 s" in found.remedy


# ways of writing tables


def test_decimal_comma_with_semicolons_is_recognised(written: Written, columns: Columns, as_csv: Csv) -> None:
    text = as_csv(columns(), ";")
    comma = load_run(written(text.replace(".", ",")))
    point = load_run(written(text))
    np.testing.assert_array_equal(comma.columns["e1"], point.columns["e1"])


def test_decimal_comma_without_semicolons_is_reported(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    found = problems_of(lambda: load_run(written(as_csv(columns()).replace(".", ","))))
    assert found[0].line == 2 and "semicolons" in found[0].remedy


def test_windows_files_with_mark_comments_and_blank_lines_are_read(
    written: Written, columns: Columns, as_csv: Csv
) -> None:
    plain = load_run(written(as_csv(columns())))
    rows = lines(as_csv(columns()))
    rows.insert(500, "# tunnel")
    rows.insert(300, "")
    text = "# recorded by\r\n\r\n" + "\r\n".join(rows) + "\r\n\r\n"
    read = load_run(written(b"\xef\xbb\xbf" + text.encode()))
    np.testing.assert_array_equal(read.columns["e1"], plain.columns["e1"])


def test_latin_1_and_quoted_headers_are_read(written: Written, columns: Columns, as_csv: Csv) -> None:
    text = as_csv(columns()).replace("e1 [m]", "e1 [µm]").replace("t [s]", '"t [s]"')
    run = load_run(written("# Prüfstand\n".encode("latin-1") + text.encode("latin-1")))
    assert run.units["e1"] == "µm"


def test_tabs_and_a_separator_behind_the_last_cell_are_read(written: Written, columns: Columns, as_csv: Csv) -> None:
    assert load_run(written(as_csv(columns(), "\t"))).counts["used"] == 1000
    assert load_run(written(as_csv(columns()).replace("\n", ",\n"))).counts["used"] == 1000


def test_gzip_is_recognised_by_its_bytes(written: Callable[..., Path], columns: Columns, as_csv: Csv) -> None:
    packed = gzip.compress(as_csv(columns()).encode())
    assert load_run(written(packed, "run.csv.gz")).sha256 == load_run(written(packed, "run.csv")).sha256


def test_faulty_cells_are_reported_together_with_line_and_column(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    rows = lines(as_csv(columns()))
    rows[10] = "0.18,40,abc,1,1"
    rows[20] = "0.38,40,1,1"
    rows[30] = "0.58,4_0,1,1,1"
    found = problems_of(lambda: load_run(written("\n".join(rows))))
    assert [(p.line, p.column, p.key) for p in found] == [(11, 9, "yw"), (21, 1, ""), (31, 6, "v")]
    assert found[1].message == "has 4 cells, the header has 5"


def test_duplicate_names_are_reported(written: Written, problems_of: ProblemsOf) -> None:
    found = problems_of(lambda: load_run(written("t [s],e1 [m],e1 [mm],[m]\n0,1,2,3\n")))
    assert [(p.line, p.column) for p in found] == [(1, 14), (1, 22)]


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"", "no header"),
        (b"# only\n", "no header"),
        (b"t [s],v [m/s]\n", "no row"),
        (b"\xff\xfet\x00", "UTF-16"),
        (b"PK\x03\x04zip", "spreadsheet"),
        (gzip.compress(b"t [s]\n" + bytes(1000), mtime=0)[:-9], "damaged"),
    ],
)
def test_a_file_that_is_not_a_table_is_reported(
    data: bytes, what: str, written: Written, problems_of: ProblemsOf
) -> None:
    assert what in problems_of(lambda: load_run(written(data)))[0].message


def test_an_absent_file_is_reported(tmp_path: Path, problems_of: ProblemsOf) -> None:
    assert "cannot be read" in problems_of(lambda: load_run(tmp_path / "no.csv"))[0].message


def test_too_many_rows_numbers_or_bytes_are_rejected(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    packed = written(gzip.compress(as_csv(columns()).encode()))
    monkeypatch.setattr(table, "MAX_ROWS", 999)
    assert "more than 999 rows" in problems_of(lambda: load_run(packed))[0].message
    monkeypatch.setattr(table, "MAX_ROWS", 1000)
    assert load_run(packed).counts["rows"] == 1000
    monkeypatch.setattr(table, "MAX_VALUES", 1001)
    assert "more than 1001 numbers" in problems_of(lambda: load_run(packed))[0].message
    monkeypatch.setattr(table, "MAX_VALUES", 10**6)
    monkeypatch.setattr(table, "MAX_BYTES", 1000)
    assert "uncompressed" in problems_of(lambda: load_run(packed))[0].message


def test_a_line_without_an_end_is_rejected_before_it_fills_the_memory(
    written: Written, problems_of: ProblemsOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(table, "BLOCK_BYTES", 1 << 16)
    packed = written(gzip.compress(b"t [s],v [m/s]\n" + b"1," * (2 << 20)))
    assert "a line of more than" in problems_of(lambda: load_run(packed))[0].message


def test_blocks_are_joined_without_loss(
    written: Written, columns: Columns, as_csv: Csv, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(as_csv(columns()))
    whole = load_run(path).columns["e1"]
    monkeypatch.setattr(table, "BLOCK_BYTES", 777)
    np.testing.assert_array_equal(load_run(path).columns["e1"], whole)


def test_parsing_cell_by_cell_reads_the_same_numbers(
    written: Written, columns: Columns, as_csv: Csv, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(as_csv(columns()))
    fast = load_run(path).columns["e1"]
    monkeypatch.setattr(table_cells, "_parse_with_numpy", lambda block: None)
    np.testing.assert_array_equal(load_run(path).columns["e1"], fast)


def test_times_of_the_day_and_a_word_are_each_reported_once(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    header, *rows = lines(as_csv(columns()))
    cells = [row.split(",") for row in rows]
    text = "\n".join(
        [header, *(f"10:00:{i // 50:02d}.{2 * (i % 50):02d},40,0,OVER,{c[4]}" for i, c in enumerate(cells))]
    )
    times, word = problems_of(lambda: load_run(written(text)))
    assert (times.line, times.column, times.key) == (2, 1, "t") and "`railui import`" in times.remedy
    assert times.message == "'10:00:00.00' is a time of the day, not a number (and 999 more rows)"
    assert (word.line, word.key, word.message) == (2, "e1", "'OVER' is not a number (and 999 more rows)")


def test_decimal_commas_between_commas_are_reported_once(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf
) -> None:
    header, *rows = lines(as_csv(columns()))
    text = "\n".join([header, *(row.replace(".", ",") for row in rows)])
    [problem] = problems_of(lambda: load_run(written(text)))
    assert problem.line == 2 and "999 more rows)" in problem.message
    assert "decimals with a comma need semicolons between the cells" in problem.remedy


# units, as docs/columns.md states them


@pytest.mark.parametrize("name", ["t", "s", "v", "yw", "phiw", "gauge", "e1", "ay1", "ayf", "rf", "d1", "psi1", "Qy"])
def test_each_column_of_a_vehicle_needs_a_unit(
    written: Written, columns: Columns, as_csv: Csv, problems_of: ProblemsOf, name: str
) -> None:
    recorded = {header: x for header, x in columns().items() if header.split()[0] != name} | {name: columns()["t [s]"]}
    problems = problems_of(lambda: load_run(written(as_csv(recorded))))
    assert [(p.key, p.message) for p in problems] == [(name, "has no unit")]
    assert "without unit is taken as SI" not in COLUMNS_PAGE


def test_of_a_rig_only_the_time_needs_a_unit(written: Written, problems_of: ProblemsOf) -> None:
    assert load_run(written(rig(u="", z=""))).units == {"t": "s", "u": "", "z": ""}
    [problem] = problems_of(lambda: load_run(written(rig(u="", z="").replace("t [s]", "t"))))
    assert (problem.key, problem.message) == ("t", "has no unit")
    assert "Of a rig and of a component on a bench only `t` needs one" in COLUMNS_PAGE


# rigs


def rig(rate: float = 1000.0, n: int = 2000, **units: str) -> str:
    t = np.arange(n) / rate
    names = {"u": "V", "z": "mm", **units}
    head = ",".join(["t [s]", *(f"{k} [{u}]" if u else k for k, u in names.items())])
    rows = (",".join([f"{x:.9g}", *(f"{np.sin(30 * x + i):.9g}" for i in range(len(names)))]) for x in t)
    return "\n".join([head, *rows])


def test_a_rig_keeps_its_own_units_as_labels(written: Written) -> None:
    run = load_run(written(rig()))
    assert (run.kind, run.rate, run.responses) == ("rig", 1000.0, ("z",))
    assert run.units == {"t": "s", "u": "V", "z": "mm"}
    assert run.columns["z"][0] == pytest.approx(np.sin(1.0))
    assert usable(run) == [(0, 2000)]  # bench tests may last two seconds


def test_a_free_decay_has_no_input(written: Written) -> None:
    text = "\n".join(",".join([x.split(",")[0], x.split(",")[2]]) for x in lines(rig()))
    run = load_run(written(text))
    assert not run.columns["u"].any() and "u is absent: taken as 0" in run.notes


def test_a_slow_record_of_a_rig_may_repeat_a_value(written: Written) -> None:
    t = np.arange(500) * 4.0
    u, z = np.cos(2 * np.pi * t / 400.0), np.round(np.sin(2 * np.pi * t / 400.0), 2)
    rows = [f"{a:.0f},{b:.9g},{c:.2f}" for a, b, c in zip(t, u, z, strict=True)]
    assert usable(load_run(written("\n".join(["t [s],u [V],z [V]", *rows])))) == [(0, 500)]
    rows[200:220] = [f"{4 * k},0,0.3" for k in range(200, 220)]  # twenty equal samples
    assert usable(load_run(written("\n".join(["t [s],u [V],z [V]", *rows])))) == [(0, 200), (220, 500)]


def test_rates_of_a_rig_follow_the_unit_of_its_motion(written: Written) -> None:
    same = load_run(written(rig(vz="mm/s", az="mm/s^2")))
    mixed = load_run(written(rig(vz="mm/s", az="m/s^2")))
    np.testing.assert_allclose(mixed.columns["az"], 1000 * same.columns["az"])
    assert mixed.units["az"] == "mm/s^2" and any("az converted" in note for note in mixed.notes)
    assert load_run(written(rig(z="V", vz="V", az="arb"))).units["az"] == "arb"


def test_a_rig_without_motion_is_no_rig(written: Written, problems_of: ProblemsOf) -> None:
    found = problems_of(lambda: load_run(written(rig()), "bogie"))
    assert [p.key for p in found] == ["v", "yw", ""]


def test_a_rig_faster_than_100_khz_is_rejected(written: Written, problems_of: ProblemsOf) -> None:
    assert load_run(written(rig(1e5))).rate == 1e5
    assert "more than 100000 Hz" in problems_of(lambda: load_run(written(rig(2e5))))[0].message


# the shared runs


@pytest.mark.parametrize("name", ["worn_axle_box", "blind_b"])
def test_the_shared_runs_load_whole(shared: Path, name: str) -> None:
    run = load_run(shared / name / "run_a.csv.gz")
    assert (run.rate, run.counts["used"], len(run.responses), run.notes) == (200.0, 14000, 8, ())
