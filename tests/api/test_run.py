"""Runs and tracks built of arrays and frames."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import railui
from tests.api.scipy_rig import arrays
from tests.cli.runner import ROOT

RUN = ROOT / "designs/campaigns/worn_axle_box/run_a.csv.gz"


def test_units_convert_the_arrays_of_a_vehicle_to_si() -> None:
    file = railui.Run.load(RUN)
    scaled = {**file.columns, "e1": 1e3 * file.columns["e1"], "v": 3.6 * file.columns["v"]}
    run = railui.Run.from_arrays(scaled, units={"e1": "mm", "v": "km/h"})
    for name in ("e1", "v"):
        assert run.columns[name] == pytest.approx(file.columns[name], rel=1e-12)
    assert run.units["e1"] == "mm" and run.column_units["e1"] == "m"


@pytest.mark.parametrize(
    ("changes", "units", "message"),
    [
        ({}, {"e1": "kg"}, "run: e1: the unit kg does not fit the leading wheelset relative to the rails"),
        ({"e1": 1e3}, {}, "run: e1: its standard deviation is 2.39 m"),
        ({}, {"e3": "m"}, "run: units.e3: no such column"),
    ],
)
def test_faulty_arrays_are_refused_like_faulty_files(
    changes: dict[str, float], units: dict[str, str], message: str
) -> None:
    file = railui.Run.load(RUN)
    columns = {name: changes.get(name, 1.0) * values for name, values in file.columns.items()}
    with pytest.raises(railui.FileProblems, match=message):
        railui.Run.from_arrays(columns, units=units)


def test_arrays_of_different_length_are_refused() -> None:
    with pytest.raises(ValueError, match="one dimension and one length"):
        railui.Run.from_arrays(t=np.arange(100.0), z=np.zeros(99))


def test_missing_values_interrupt_a_run_as_in_a_file(tmp_path: Path) -> None:
    columns = arrays(1)
    columns["z"][1000] = np.nan
    run = railui.Run.from_arrays(columns)
    run.save(tmp_path / "run.csv.gz")
    again = railui.Run.load(tmp_path / "run.csv.gz")
    assert run.segments == again.segments and len(run.segments) == 2
    assert all(np.array_equal(run.columns[n], again.columns[n], equal_nan=True) for n in columns)
    assert run.sha256 != railui.Run.from_arrays(arrays(1)).sha256


def test_a_run_and_a_track_go_through_a_frame_and_back() -> None:
    pytest.importorskip("pandas")
    run = railui.Run.load(RUN)
    frame = run.to_frame()
    assert frame.index.name == "t" and frame.attrs["units"]["ay1"] == "m/s^2"
    again = railui.Run.from_frame(frame)
    assert all(np.array_equal(run.columns[name], again.columns[name], equal_nan=True) for name in run.columns)
    track = railui.Track.synthetic("erri_b176_low", 300.0, seed=1)
    assert np.array_equal(railui.Track.from_frame(track.to_frame()).phiw, track.phiw)


def test_a_run_goes_through_xarray_and_back() -> None:
    xarray = pytest.importorskip("xarray")
    run = railui.Run.from_arrays(arrays(1), units={"z": "mm"})
    dataset = run.to_xarray()
    assert isinstance(dataset, xarray.Dataset) and dataset["z"].attrs["units"] == "mm"
    assert np.array_equal(railui.Run.from_xarray(dataset).columns["z"], run.columns["z"])


def test_xarray_gets_variables_over_time_with_their_units(monkeypatch: pytest.MonkeyPatch) -> None:
    def dataset(variables: Any, coordinates: Any, attributes: Any) -> Any:
        return variables, coordinates, attributes

    monkeypatch.setitem(sys.modules, "xarray", SimpleNamespace(Dataset=dataset))
    variables, coordinates, attributes = railui.Run.from_arrays(arrays(1), name="bench", units={"z": "mm"}).to_xarray()
    dimension, values, more = variables["z"]
    assert dimension == "t" and more == {"units": "mm"} and values.shape == (6000,)
    assert list(coordinates) == ["t"] and attributes == {"title": "bench"}


@pytest.mark.parametrize(("name", "method"), [("pandas", "to_frame"), ("xarray", "to_xarray")])
def test_an_absent_library_is_named_with_its_remedy(name: str, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, name, None)
    track = railui.Track.synthetic("erri_b176_low", 300.0)
    with pytest.raises(ImportError, match=rf"needs {name}.*pip install '\.\[frames\]'"):
        getattr(track, method)()


def test_a_track_of_arrays_gives_the_ride_of_its_file(tmp_path: Path) -> None:
    track = railui.Track.synthetic("erri_b176_low", 300.0, seed=1)
    file = track.save(tmp_path / "line.csv")
    loaded = railui.Track.load(file)
    built = railui.Track.from_arrays(loaded.s, 1e3 * loaded.yw, loaded.phiw, units={"yw": "mm"}, name="mine")
    assert built.name == "mine" and built.yw == pytest.approx(loaded.yw, abs=1e-12)
    design = railui.Design.load(ROOT / "designs/test_bogie.yaml")
    assert design.ride(built, 40.0).score == pytest.approx(design.ride(file, 40.0).score, rel=1e-6)


def test_a_track_is_generated_as_its_spec_says() -> None:
    track = railui.Track.synthetic("fra_4", 500.0, seed=2, scale=0.5)
    assert np.array_equal(track.yw, railui.Track.from_spec("fra_4 length=500 scale=0.5", seed=2).yw)
    assert np.array_equal(track.yw, railui.synthetic_track("fra_4", 500.0, seed=2, scale=0.5).yw)
    assert track.seed == 2


def test_samples_of_a_track_that_are_not_equally_spaced_need_a_spacing() -> None:
    s = np.linspace(0.0, 20.0, 400) ** 1.5
    with pytest.raises(ValueError, match="equally spaced"):
        railui.Track.from_arrays(s, 1e-3 * np.sin(s))
    even = railui.Track.from_arrays(s, 1e-3 * np.sin(s), spacing=0.25)
    assert even.spacing == pytest.approx(0.25)


def test_a_run_is_saved_as_parquet_with_all_digits(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    t = np.arange(0.0, 20.0, 0.01)
    run = railui.Run.from_arrays(t=t, u=np.sin(9.0 * t), z=1e3 * np.sin(9.0 * t - 0.5), units={"z": "mm"})
    table = parquet.read_table(run.save(tmp_path / "run.parquet"))
    assert table.column_names == ["t [s]", "u", "z [mm]"]
    np.testing.assert_array_equal(table["z [mm]"].to_numpy(), 1e3 * np.sin(9.0 * t - 0.5))
