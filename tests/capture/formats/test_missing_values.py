"""Marks of missing values in files of every format are gaps, numbers of a signal are not."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from railui.arrays import FloatArray
from railui.capture.formats import read_recordings
from railui.capture.formats.sentinels import SENTINELS
from railui.capture.processing.recording import Recording
from tests.cli.runner import run

T = np.arange(3000) / 200.0
ROWS = slice(1000, 1010)


def marked(value: float, rows: slice = ROWS) -> FloatArray:
    x = np.sin(7 * T) + 0.3 * np.cos(31 * T)
    x[rows] = value
    return x


def write_csv(path: Path, columns: dict[str, FloatArray]) -> Path:
    rows = "\n".join(",".join(f"{x:.9g}" for x in row) for row in zip(*columns.values(), strict=True))
    path.write_text(f"{','.join(columns)}\n{rows}\n")
    return path


@pytest.mark.parametrize("value", [-9999.0, -999.0, -99.0, 9999.0, 99999.0, 1e30, -1e30, 32767.0, 99.99])
@pytest.mark.parametrize("name", ["a.csv", "a.h5", "a.mf4", "a.mat", "run_001.csv"])
def test_a_customary_mark_of_a_missing_value_is_a_gap_with_a_note(tmp_path: Path, name: str, value: float) -> None:
    if name.endswith(".csv"):
        write_csv(tmp_path / name, {"t [s]": T, "e1 [mm]": marked(value)})
        (tmp_path / "raw.bin").write_bytes(b"")
    else:
        recording = Recording("a", T, {"e1": marked(value)}, {"e1": "mm"})
        module = {"a.h5": "hdf5", "a.mf4": "mdf", "a.mat": "matlab"}[name]
        import_module(f"railui.capture.formats.{module}").write(tmp_path / name, recording)
    (found,) = read_recordings(tmp_path / name)
    assert np.flatnonzero(np.isnan(found.channels["e1"])).tolist() == list(range(1000, 1010))
    assert f"e1: 10 values of {value:.7g} mm are gaps: a mark of missing values" in found.notes


@pytest.mark.parametrize(
    "x",
    [
        np.arange(3000.0) + 9000.0,  # a counter that passes 9999
        np.where(np.arange(3000) % 500 == 0, 99.0, 30 * np.sin(T)),  # shocks
        np.full(3000, 9999.0),
        marked(-9998.0),
    ],
)
def test_numbers_of_a_signal_are_no_marks(tmp_path: Path, x: FloatArray) -> None:
    (found,) = read_recordings(write_csv(tmp_path / "a.csv", {"t [s]": T, "x [mm]": x}))
    assert np.allclose(found.channels["x"], x, rtol=1e-8) and found.notes == []


def test_marks_rounded_to_32_bits_are_known() -> None:
    rounded = np.float64(np.float32(1e30))
    assert rounded != 1e30 and {rounded, -rounded, 1e30, -9999.0} <= set(SENTINELS.tolist())


def test_fill_value_scale_and_offset_of_hdf5_are_applied(tmp_path: Path) -> None:
    import h5py

    stored = np.rint(1000 * np.sin(T)).astype(np.int16)
    stored[ROWS] = -1234
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["e1"], file["e2"] = T, stored, np.where(stored == -1234, -5.5, np.sin(T))
        file["t"].attrs["unit"], file["e1"].attrs["unit"] = "s", "m"
        file["e1"].attrs.update({"_FillValue": np.int16(-1234), "scale_factor": 1e-6, "add_offset": 2e-3})
        file["e2"].attrs["missing_value"] = -5.5
    (found,) = read_recordings(tmp_path / "a.h5")
    for name in ("e1", "e2"):
        assert np.flatnonzero(np.isnan(found.channels[name])).tolist() == list(range(1000, 1010))
    assert np.nanmax(np.abs(found.channels["e1"] - (1e-3 * np.sin(T) + 2e-3))) < 1e-6
    assert "e1: 10 values of -1234 are gaps: its _FillValue" in found.notes
    assert "e2: 10 values of -5.5 are gaps: its missing_value" in found.notes
    assert "e1: its attributes scale_factor and add_offset are applied" in found.notes


@pytest.mark.parametrize(("value", "rows"), [(-9999.0, slice(100, 101)), (-999.0, ROWS), (-99.0, ROWS)])
def test_a_mark_in_the_record_of_a_recording_car_is_no_track(tmp_path: Path, value: float, rows: slice) -> None:
    write_csv(tmp_path / "car.csv", {"s [m]": np.arange(3000) / 4, "yw [mm]": 3 * marked(value / 3, rows)})
    (tmp_path / "map.yaml").write_text("sensors: {yw: {channel: yw}}\n")
    result = run(
        "import", str(tmp_path / "car.csv"), "--map", str(tmp_path / "map.yaml"), "-o", str(tmp_path / "x.csv")
    )
    assert result.exit_code == 2 and "no value of yw; yw: " in result.stderr
    assert f"of {value:g} mm" in result.stderr and not (tmp_path / "x.csv").exists()


def test_a_written_file_keeps_the_gaps(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", {"t [s]": T, "e1 [mm]": marked(-9999.0)})
    assert run("import", str(tmp_path / "a.csv"), "-o", str(tmp_path / "b.h5")).exit_code == 0
    (found,) = read_recordings(tmp_path / "b.h5")
    assert np.count_nonzero(np.isnan(found.channels["e1"])) == 10
