"""Results as objects: attributes, the JSON of the commands, summaries and figures."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest

import railui
from railui.io.atomic import to_json_value
from tests.cli.runner import BOGIE, ROOT, TRACK, document, run

matplotlib.use("Agg")


@pytest.fixture(scope="module")
def design() -> railui.Design:
    return railui.Design.load(BOGIE)


@pytest.fixture(scope="module")
def results(design: railui.Design) -> dict[str, Any]:
    stiffer = design.with_values({"vehicle.wheel_load": "50 kN"})
    return {
        "ride": stiffer.ride(TRACK, 40.0),
        "stability": stiffer.stability([20.0, 40.0, 60.0]),
        "response": stiffer.response(40.0, TRACK, channels=["e1", "ayf"]),
        "curve": stiffer.curve([400.0, 600.0, 800.0], 0.1),
        "sensitivity": stiffer.sensitivity(["klingel_wavelength"]),
        "map": stiffer.map(*AXES, ["klingel_wavelength"]),
        "assess": stiffer.assess(TRACK, 40.0, section_length=100.0),
    }


AXES = ("contact.conicity=0.1:0.4:0.1", "vehicle.primary.lateral_stiffness=2e6:4e6:1e6")
COMMANDS = {
    "ride": ("--track", TRACK, "--speed", "40"),
    "stability": ("--speeds", "20:60:20"),
    "response": ("--track", TRACK, "--speed", "40", "--channels", "e1,ayf"),
    "curve": ("--radii", "400:800:200", "--cant-deficiency", "0.1"),
    "sensitivity": ("--of", "klingel_wavelength"),
    "map": ("--x", AXES[0], "--y", AXES[1], "--of", "klingel_wavelength", "-o", "map"),
    "assess": ("--speed", "40", "--stretch", "100"),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_dictionary_of_a_result_is_the_json_of_its_command(
    name: str, results: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    of = (TRACK, BOGIE) if name == "assess" else (BOGIE,)
    printed = document(run(name, *of, "vehicle.wheel_load=50 kN", *COMMANDS[name], "-q", "--json", "-"))
    assert json.loads(json.dumps(results[name].to_dict(), allow_nan=False)) == printed


@pytest.mark.parametrize("name", COMMANDS)
def test_a_result_is_frozen_and_presents_itself(name: str, results: dict[str, Any]) -> None:
    result = results[name]
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.data = {}
    text, html = result.summary(), result._repr_html_()
    assert result.design.name in text.splitlines()[0]
    assert html.startswith("<table") and "<script" not in html and html.count("<tr>") == len(result.summary_rows())


def test_names_from_files_are_escaped_in_html() -> None:
    design = railui.Design.from_dict({"name": "<b>bogie</b>", "vehicle": {"rig": {"mass": 95.0}}})
    assert "&lt;b&gt;bogie" in design._repr_html_() and "<b>bogie" not in design._repr_html_()


def test_functions_return_the_data_of_the_objects(design: railui.Design, results: dict[str, Any]) -> None:
    stiffer = design.with_values({"vehicle.wheel_load": "50 kN"})
    assert railui.ride(stiffer, TRACK, 40.0) == results["ride"].data
    assert railui.stability(stiffer, [20.0, 40.0, 60.0]) == results["stability"].data
    assert railui.curve(stiffer, 600.0, 0.1) == results["curve"].cases[1] == stiffer.curve(600.0, 0.1).data
    assert railui.sensitivity(stiffer, ["klingel_wavelength"]) == results["sensitivity"].data
    mapped = railui.response_map(stiffer, *AXES, ["klingel_wavelength"])
    assert to_json_value(mapped) == to_json_value(dict(results["map"].data))
    assert railui.assess(TRACK, stiffer, 40.0, section_length=100.0) == results["assess"].data


def test_the_attributes_of_results_are_their_data(results: dict[str, Any]) -> None:
    ride, stability, response = results["ride"], results["stability"], results["response"]
    assert (ride.score, ride.ride_class, ride.speed) == (ride.data["score"], ride.data["class"], 40.0)
    assert set(ride.units) <= set(ride.data)
    assert stability.linear_critical_speed == stability.data["linear_critical_speed"]
    assert len(stability.modes) == len(stability.to_frame())
    h = response.transfer("e1")
    assert np.abs(h) == pytest.approx(np.asarray(response.data["transfer"]["e1"]["yw"]["magnitude"]))
    density = np.trapezoid(response.density("e1"), response.frequencies)
    assert np.sqrt(density) == pytest.approx(response.rms["e1"], rel=0.05)


def test_results_over_radii_parameters_and_sections_are_frames(results: dict[str, Any]) -> None:
    curve, sensitivity = results["curve"].to_frame(), results["sensitivity"].to_frame()
    assert curve.loc[600.0, "wear_number"] == results["curve"].cases[1]["wear_number"]
    assert list(curve.index) == [400.0, 600.0, 800.0] and curve.attrs["units"]["displacement.2"] == "m"
    largest = results["sensitivity"].largest("klingel_wavelength", 1)[0]
    column = sensitivity["klingel_wavelength change"]
    assert abs(column[largest["path"]]) == column.abs().max() > 0.0
    grid, frame = results["map"].values("klingel_wavelength"), results["map"].to_frame()
    assert grid.shape == (3, 4) and frame["klingel_wavelength"].tolist() == grid.ravel().tolist()
    assert frame["contact.conicity"].tolist()[:4] == pytest.approx([0.1, 0.2, 0.3, 0.4])
    sections = results["assess"].to_frame()
    assert sections["score"].is_monotonic_increasing and len(sections) == len(results["assess"].sections) == 3


def test_series_of_a_ride_are_those_of_simulate(design: railui.Design) -> None:
    series = design.simulate(TRACK, 40.0, ["e1", "ayf"])
    plain = railui.simulate(design, TRACK, 40.0, ["e1", "ayf"])
    assert all(np.array_equal(series[name], plain[name]) for name in ("t", "s", "e1", "ayf"))
    assert series.units["ayf"] == "m/s^2" and series.diverged_at is None


def test_series_are_saved_as_a_run(design: railui.Design, tmp_path: Path) -> None:
    series = design.simulate("erri_b176_low length=600", 40.0, ["e1", "e2", "ay1"])
    saved = railui.Run.load(series.save(tmp_path / "run.csv"))
    assert saved.columns["ay1"] == pytest.approx(series["ay1"], rel=1e-8, abs=1e-12)


def draw_calls(results: dict[str, Any], design: railui.Design) -> dict[str, Any]:
    ride, stability, response = results["ride"], results["stability"], results["response"]
    track, series = railui.Track.from_spec(TRACK), design.simulate(TRACK, 40.0, ["e1"])
    return {
        "displacement": ride.plot_displacement,
        "acceleration": ride.plot_acceleration,
        "ride spectrum": ride.plot_spectrum,
        "guiding forces": ride.plot_guiding_forces,
        "damping": stability.plot_damping,
        "frequency": stability.plot_frequency,
        "magnitude": lambda ax: response.plot_magnitude("e1", ax=ax),
        "density": lambda ax: response.plot_density("ayf", ax),
        "curves": results["curve"].plot_displacement,
        "guiding forces in curves": results["curve"].plot_guiding_forces,
        "wear": results["curve"].plot_wear,
        "map": lambda ax: results["map"].plot("klingel_wavelength", ax),
        "score of sections": results["assess"].plot_score,
        "geometry of sections": results["assess"].plot_geometry,
        "flange contact of sections": results["assess"].plot_flange_contact,
        "track": lambda ax: track.plot("phiw", ax),
        "track spectrum": track.plot_spectrum,
        "series": lambda ax: series.plot("e1", ax),
    }


def test_figures_are_drawn_on_given_axes_which_they_return(results: dict[str, Any], design: railui.Design) -> None:
    from matplotlib.figure import Figure

    for name, draw in draw_calls(results, design).items():
        ax = Figure().subplots()
        assert draw(ax) is ax, name
        assert ax.has_data() and ax.get_xlabel() and ax.get_ylabel(), name


def test_a_figure_of_its_own_is_drawn_without_axes(results: dict[str, Any]) -> None:
    from matplotlib import pyplot

    ax = results["ride"].plot_displacement()
    assert ax.figure.number in pyplot.get_fignums()
    pyplot.close(ax.figure)


def test_what_a_result_has_not_is_refused_with_a_remedy(results: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="fold=True"):
        results["stability"].plot_bifurcation()
    with pytest.raises(ValueError, match="compute several"):
        results["curve"].design.curve(600.0).plot_wear()
    with pytest.raises(ValueError, match="no figure of 'radius'"):
        results["curve"].plot("radius")
    with pytest.raises(ValueError, match="no panel 'displacements': did you mean 'displacement'"):
        results["ride"].plot_panel("displacements")


def test_a_changed_design_stays_of_its_class_with_its_overrides(design: railui.Design) -> None:
    changed = design.with_values({"vehicle.wheel_load": "50 kN"}).with_values({"contact.spin_creep": 0.2})
    assert isinstance(changed, railui.Design)
    assert changed.overrides == {"vehicle.wheel_load": "50 kN", "contact.spin_creep": 0.2}
    assert railui.Design.from_text(changed.to_yaml()).values == changed.values
    with pytest.raises(railui.FileProblems, match="did you mean"):
        design.with_values({"vehicle.wheel_lod": 1.0})


def test_a_search_of_mappings_is_that_of_its_file(tmp_path: Path) -> None:
    study = railui.Study.build(
        BOGIE,
        {"vehicle.secondary.lateral_damping": ("10 kN*s/m", "100 kN*s/m")},
        [{"minimise": "weighted_acceleration", "over": "mean"}, {"maximise": "flange_margin", "over": "worst"}],
        track="erri_b176_low length=300",
        speed="144 km/h",
        seed=[1],
        method={"kind": "nsga2", "population": 4, "generations": 2, "seed": 3},
        directory=tmp_path / "study",
    )
    found = study.optimise()
    words = ("optimise", str(tmp_path / "study/study.yaml"), "-o", str(tmp_path / "result"), "-q", "--json", "-")
    printed = document(run(*words))
    assert printed["pareto"] == json.loads(json.dumps(found.to_dict()["pareto"]))
    assert printed.keys() == found.to_dict().keys()
    stored = study.optimise(tmp_path / "stored")
    assert stored.data["pareto"] == found.data["pareto"] and railui.status(tmp_path / "stored")["state"] == "finished"
    best = found.design()
    assert dict(best.overrides) == dict(found.front[found.knee or 0].variables)
    assert len(found.to_frame()) == len(found.front) and found.evaluations == 8
    with pytest.raises(IndexError):
        found.design(99)


def test_files_of_every_kind_load_as_the_classes_of_the_front() -> None:
    kinds = {
        "designs/test_bogie.yaml": railui.Design,
        "designs/campaigns/worn_axle_box": railui.Campaign,
        "designs/studies/test_bogie.yaml": railui.Study,
        "designs/campaigns/worn_axle_box/run_a.csv.gz": railui.Run,
    }
    for file, kind in kinds.items():
        assert isinstance(railui.load(ROOT / file if "." in file else ROOT / file / "campaign.yaml"), kind)
