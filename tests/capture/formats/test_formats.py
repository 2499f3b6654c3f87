"""Readers and writers of recordings in all formats."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from railui.capture.formats import delimited, read_recordings, write_recording
from railui.capture.processing.recording import Recording
from railui.cli import cli
from railui.io.problems import FileProblems
from tests.capture.simulated_runs import RATE, SERIES, UNITS, T


@pytest.mark.parametrize("name", ["a.mf4", "a.uff", "a.h5", "a.mat"])
def test_written_recording_is_read_back(tmp_path: Path, name: str) -> None:
    write_recording(tmp_path / name, Recording("a", T, SERIES, UNITS))
    (recording,) = read_recordings(tmp_path / name)
    assert recording.interval == pytest.approx(1 / RATE)
    for channel, x in SERIES.items():
        assert np.allclose(recording.channels[channel], x, rtol=1e-5, atol=1e-7), channel
        assert recording.units[channel] == UNITS[channel]


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("t [s],way [mm]\n0,1.5\n0.1,\n0.2,2.5\n0.3,3\n", "utf-8"),
        ("\ufefft [s];way [mm]\r\n0;1,5\r\n0,1;\r\n0,2;2,5\r\n0,3;3\r\n", "utf-8"),
        ("Messung Gerät 7\r\nt;way\r\ns;mm\r\n0,0;1,5\r\n0,1;NaN\r\n0,2;2,5\r\n0,3;3,0\r\n", "cp1252"),
        ("t (s)\tway (mm)\n0\t1.5\n0.1\t-\n0.2\t2.5\n0.3\t3\n", "utf-16"),
    ],
)
def test_csv_dialects_are_read(tmp_path: Path, text: str, encoding: str) -> None:
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    (recording,) = read_recordings(tmp_path / "a.csv")
    assert np.allclose(recording.t, [0, 0.1, 0.2, 0.3]) and recording.units["way"] == "mm"
    assert np.allclose(recording.channels["way"], [1.5, np.nan, 2.5, 3.0], equal_nan=True)


def test_square_brackets_in_a_channel_name_are_no_markup(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t;acc [/b] y;way :smile: [bold]x\n" + "".join(f"{i};1;2\n" for i in range(9)))
    result = CliRunner().invoke(cli, ["import", str(tmp_path / "a.csv")])
    assert result.exit_code == 0, result.output
    assert "acc [/b] y" in result.output and "way :smile: [bold]x" in result.output


def test_claimed_size_beyond_the_limit_is_refused(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("t", shape=(10**12,), dtype="f8", chunks=(1 << 16,))  # no data are written
    with pytest.raises(FileProblems, match="claims 1000000000000 values"):
        read_recordings(tmp_path / "a.h5")


def test_file_too_large_after_decompression_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(delimited, "MAX_BYTES", 1000)
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(b"t;v\n" + b"0;1\n" * 1000))
    with pytest.raises(FileProblems, match="larger than 1000 bytes"):
        read_recordings(tmp_path / "a.csv.gz")
