"""Time series of a ride: a run with units that the other commands read, figures and a page."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from railui.io.problems import FileProblems
from railui.io.series_file import write_series
from railui.io.table import read_table
from railui.ride_quality.running_safety import characteristic_values, sliding_mean
from railui.ride_quality.time_series import ride_series
from railui.runs.run import load_run
from railui.track.excitation import Excitation, resolve_track
from railui.vehicle.channels import all_channels, channel_unit
from railui.vehicle.resolve import resolve_model
from tests.cli.runner import BOGIE, ROOT, document, run, run_ride


def test_the_series_of_a_ride_is_a_run_whose_motions_obey_their_kinematics(tmp_path: Path) -> None:
    file = tmp_path / "run.csv.gz"
    words = ("ride", BOGIE, "--track", "erri_b176_low length=500 seed=1", "--speed", "40", "--json", "-")
    found = document(run(*words, "--series", str(file)))
    read = load_run(file)
    e1 = read.columns["e1"]
    assert float(e1.std()) == pytest.approx(found["statistics"]["sd_e"][0], rel=1e-6)
    # e_1 = y_1 - y_w1 - r phi_w1, so that y_1 is known, and its second derivative is ay1
    y1 = e1 + read.columns["yw"] + 0.46 * read.columns["phiw"]
    ay1 = np.gradient(np.gradient(y1, read.columns["t"]), read.columns["t"])[50:-50]
    assert np.std(ay1 - read.columns["ay1"][50:-50]) < 0.02 * np.std(ay1)
    assert {"Y1.right", "z.secondary_lateral.0"} <= set(read.unknown_columns)


def test_the_sums_of_guiding_forces_are_those_of_both_wheels() -> None:
    excitation = Excitation(resolve_track("erri_b176_low length=300 seed=1"), 40.0)
    columns = ride_series(resolve_model(BOGIE), excitation).columns
    np.testing.assert_allclose(columns["Y1"], columns["Y1.right"] + columns["Y1.left"], rtol=0, atol=1e-9)
    assert characteristic_values(sliding_mean(np.abs(columns["Y1"]), 0.1)) < 20e3


@pytest.mark.parametrize("design", ["test_bogie", "manchester_coach", "bogie_under_coach", "cooperrider"])
def test_every_channel_of_a_vehicle_has_a_unit(design: str) -> None:
    names = all_channels(resolve_model(ROOT / "designs" / f"{design}.yaml"))
    assert {channel_unit(name) for name in names} <= {"m", "m/s", "m/s^2", "rad", "rad/s", "rad/s^2", "N"}


def test_a_vehicle_that_diverges_has_empty_channels_from_there_on() -> None:
    excitation = Excitation(resolve_track("erri_b176_high length=800"), 80.0)
    series = ride_series(resolve_model(ROOT / "designs/check_bogie.yaml"), excitation, ["e1"])
    assert series.diverged_at is not None
    assert np.isnan(series.columns["e1"][series.diverged_at :]).all()
    assert np.isfinite(series.columns["e1"][: series.diverged_at]).all()
    assert np.isfinite(series.columns["yw"]).all()


def test_the_page_of_a_ride_needs_no_network_and_shows_units(tmp_path: Path) -> None:
    page, figure = tmp_path / "ride.html", tmp_path / "ride.svg"
    for file in (page, figure):
        assert run_ride("--speed", "40", "--plot", str(file)).exit_code == 0
    text = page.read_text()
    assert text.count('<img src="data:image/svg+xml') == 8 and "http" not in text.replace("http://www.w3.org", "")
    svg = figure.read_text()
    for label in ("time [s]", "frequency [Hz]", "e [mm]", "sum of Y [kN]", "s [m]", "PSD of e [m²/Hz]"):
        assert label in svg, label


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--speeds", "30,40", "--series", "a.csv"), "give one --speed and one seed"),
        (("--speed", "40", "--series", "a.xlsx"), "ends in .csv or .csv.gz or .parquet"),
        (("--speed", "40", "--plot", "a.gif"), "ends in .html, .svg, .png or .pdf"),
    ],
)
def test_a_wrong_output_file_is_refused_before_the_simulation(words: tuple[str, ...], message: str) -> None:
    result = run_ride(*words)
    assert result.exit_code == 2 and result.stdout == ""
    assert message in " ".join(result.stderr.split())


def test_parquet_without_pyarrow_names_the_optional_dependencies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(FileProblems, match=r"pip install '\.\[parquet\]'"):
        write_series(tmp_path / "run.parquet", {"t [s]": [0.0]})
    assert run_ride("--speed", "40", "--series", str(tmp_path / "run.parquet")).exit_code == 2


def test_a_ride_writes_the_same_series_to_parquet_as_to_csv(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    for name in ("run.parquet", "run.csv"):
        assert run_ride("--speed", "40", "--series", str(tmp_path / name)).exit_code == 0
    table, text = parquet.read_table(tmp_path / "run.parquet"), read_table(tmp_path / "run.csv")
    headers = [f"{name} [{unit}]" for name, unit in zip(text.names, text.units, strict=True)]
    assert table.column_names == headers and table.num_rows == len(text.rows)
    for header, name in zip(headers, text.names, strict=True):
        column = table[header].to_numpy()
        np.testing.assert_allclose(text.column(name), column, rtol=1e-8, atol=1e-8 * np.abs(column).max())


def test_parquet_has_the_doubles_of_the_series(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    write_series(tmp_path / "run.parquet", {"t [s]": [0.0, 0.1], "e1 [m]": [1 / 3, np.nan]}, ["simulated"])
    table = parquet.read_table(tmp_path / "run.parquet")
    assert table.column_names == ["t [s]", "e1 [m]"] and table.schema.metadata[b"railui"] == b"simulated"
    assert table["e1 [m]"][0].as_py() == 1 / 3
