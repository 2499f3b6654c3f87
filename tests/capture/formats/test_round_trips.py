"""Property: what was written into a file comes back under its name and unit, or the file is refused."""

from __future__ import annotations

import csv
import io
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railui.arrays import FloatArray
from railui.capture.formats import read_recordings, write_recording
from railui.capture.processing.recording import Recording
from railui.io.problems import FileProblems

UNITS = ("m", "mm", "m/s^2", "deg/s", "rad", "1")
LETTERS = "abcxyzé "
names = st.text(LETTERS + ',;|\t"./#', min_size=1, max_size=8).filter(lambda s: s.strip() and s.strip()[0] not in '#"')
plain_names = st.text("abcdefgh_123", min_size=2, max_size=9).filter(lambda s: s[0].isalpha())
numbers = st.floats(-1e6, 1e6, allow_nan=False).map(lambda x: float(f"{x:.7g}"))
tables = st.integers(5, 12).flatmap(
    lambda rows: st.lists(
        st.tuples(names, st.sampled_from(UNITS), st.lists(numbers, min_size=rows, max_size=rows)),
        min_size=1,
        max_size=4,
        unique_by=lambda column: " ".join(column[0].split()),
    )
)
dialects = st.fixed_dictionaries(
    {
        "separator": st.sampled_from([",", ";", "\t", "|"]),
        "decimal": st.sampled_from([".", ","]),
        "quoting": st.sampled_from([csv.QUOTE_ALL, csv.QUOTE_MINIMAL]),
        "end": st.sampled_from(["\n", "\r\n", "\r"]),
        "encoding": st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
        "units": st.sampled_from(["brackets", "line"]),
        "title": st.sampled_from(["", "Messung 7", "Device;7", '# written by, a "logger']),
        "trailing": st.booleans(),
    }
)


def dialect_text(columns: dict[str, tuple[str, FloatArray]], dialect: dict[str, object]) -> str:
    """Return a table as an instrument's export."""
    text = io.StringIO()
    writer = csv.writer(
        text,
        delimiter=str(dialect["separator"]),
        quoting=dialect["quoting"],  # type: ignore[arg-type]
        lineterminator=str(dialect["end"]),
    )
    if dialect["title"]:
        text.write(f"{dialect['title']}{dialect['end']}")
    extra = [""] if dialect["trailing"] else []
    if dialect["units"] == "brackets":
        writer.writerow([*(f"{name} [{unit}]" for name, (unit, _) in columns.items()), *extra])
    else:
        writer.writerow([*columns, *extra])
        writer.writerow([*(unit for unit, _ in columns.values()), *extra])
    for row in zip(*(x for _, x in columns.values()), strict=True):
        writer.writerow([*(repr(float(x)).replace(".", str(dialect["decimal"])) for x in row), *extra])
    return text.getvalue()


@settings(max_examples=300, deadline=None)
@given(table=tables, dialect=dialects)
def test_a_csv_of_any_dialect_comes_back_or_is_refused(
    table: list[tuple[str, str, list[float]]], dialect: dict[str, object]
) -> None:
    rows = len(table[0][2])
    columns: dict[str, tuple[str, FloatArray]] = {"t": ("s", np.arange(rows) / 8)}
    columns |= {" ".join(name.split()): (unit, np.array(x)) for name, unit, x in table if name.strip().lower() != "t"}
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "a.csv"
        path.write_bytes(dialect_text(columns, dialect).encode(str(dialect["encoding"]), errors="replace"))
        try:
            (recording,) = read_recordings(path)
        except FileProblems:
            return
    assert np.array_equal(recording.t, columns["t"][1])
    assert set(recording.channels) == set(columns)
    for name, (unit, x) in columns.items():
        assert recording.units[name] == unit, name
        assert np.array_equal(recording.channels[name], x), name


def test_a_name_above_a_row_of_units_is_the_whole_cell(tmp_path: Path) -> None:
    rows = "".join(f"{i / 8},{i},{-i}\n" for i in range(9))
    (tmp_path / "a.csv").write_text(f"t,gap / left,gap (right)\ns,mm,mm\n{rows}")
    (recording,) = read_recordings(tmp_path / "a.csv")
    assert recording.units == {"t": "s", "gap / left": "mm", "gap (right)": "mm"}


@pytest.mark.parametrize("separator", [",", ";", "\t", "|"])
@pytest.mark.parametrize("quoting", [csv.QUOTE_ALL, csv.QUOTE_MINIMAL])
@pytest.mark.parametrize("decimal", [".", ","])
def test_usual_dialects_are_not_refused(tmp_path: Path, separator: str, quoting: int, decimal: str) -> None:
    columns = {"t": ("s", np.arange(9) / 8), "ay, left": ("m/s^2", np.sin(np.arange(9.0))), "e;1": ("mm", np.ones(9))}
    dialect = dict(
        separator=separator, quoting=quoting, decimal=decimal, end="\r\n", units="brackets", title="", trailing=False
    )
    (tmp_path / "a.csv").write_text(dialect_text(columns, dialect))
    (recording,) = read_recordings(tmp_path / "a.csv")
    for name, (unit, x) in columns.items():
        assert recording.units[name] == unit and np.array_equal(recording.channels[name], x)


values = st.floats(allow_nan=True, allow_infinity=False, width=64)
recordings = st.integers(5, 9).flatmap(
    lambda rows: st.tuples(
        st.lists(st.floats(1e-4, 10.0), min_size=rows, max_size=rows),
        st.floats(0, 2e9),
        st.sampled_from(["t", "s"]),
        st.dictionaries(
            st.one_of(plain_names, names.map(str.strip)),
            st.tuples(st.sampled_from([*UNITS, "°", None]), st.lists(values, min_size=rows, max_size=rows)),
            min_size=1,
            max_size=3,
        ),
    )
)


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".h5", ".mat", ".mf4", ".uff"])
@settings(max_examples=40, deadline=None)
@given(drawn=recordings)
def test_an_export_comes_back_or_is_refused_and_leaves_nothing(
    suffix: str, drawn: tuple[list[float], float, str, dict[str, tuple[str | None, list[float]]]]
) -> None:
    steps, start, abscissa, channels = drawn
    t = start + np.cumsum(steps)
    x = {name: np.array(column) for name, (_, column) in channels.items()}
    units = {name: unit for name, (unit, _) in channels.items()}
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / f"a{suffix}"
        try:
            write_recording(path, Recording("a", t, x, units, abscissa))
        except ValueError:
            assert list(Path(directory).iterdir()) == []
            return
        assert list(Path(directory).iterdir()) == [path]
        (found,) = read_recordings(path)
    assert found.abscissa == abscissa and np.allclose(found.t, t, rtol=1e-11, atol=0)
    for name, column in x.items():
        assert np.allclose(found.channels[name], column, rtol=1e-11, atol=0, equal_nan=True)
        assert found.units[name] in (units[name], units[name] or "1")


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".h5", ".mat", ".mf4", ".uff"])
def test_every_run_is_exported_to_every_format(tmp_path: Path, suffix: str) -> None:
    campaign = Path(__file__).parents[3] / "designs/campaigns/worn_axle_box"
    for run in sorted(campaign.glob("run_*.csv.gz")):
        (recording,) = read_recordings(run)
        write_recording(tmp_path / f"a{suffix}", recording)
        (found,) = read_recordings(tmp_path / f"a{suffix}")
        for name, x in recording.channels.items():
            if name != "t":
                assert np.allclose(found.channels[name], x, rtol=1e-11, atol=0, equal_nan=True)
                assert found.units[name] == recording.units[name]
        assert np.allclose(found.t, recording.t, rtol=0, atol=1e-9)


def test_a_gap_survives_the_export_to_a_universal_file(tmp_path: Path) -> None:
    t = np.arange(400) / 512
    t[200:] += 3.0
    write_recording(tmp_path / "a.uff", Recording("a", t, {"ay1": np.sin(t)}, {"ay1": "m/s^2"}))
    (found,) = read_recordings(tmp_path / "a.uff")
    assert np.allclose(found.t, t, rtol=0, atol=1e-9)
