"""Designed lines as YAML: alignment, irregularities, faults with their place; curvature and cant as columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from railui.cli import cli
from railui.documents.recognise import recognise
from railui.io.problems import FileProblems
from railui.io.table import write_table
from railui.optimisation.cases import cases_of
from railui.optimisation.study_reader import load_study
from railui.track import synthetic_track
from railui.track.excitation import resolve_track
from railui.track.line_file import load_line
from railui.track.line_geometry import PlanLine, cant_deficiency
from railui.track.reader import load_track, save_track

HOME = Path(__file__).parents[2]
EXAMPLE = HOME / "designs/lines/reverse_curves.yaml"
LINE = """
segments:
  - {kind: straight, length: 100 m}
  - {kind: transition, length: 50 m}
  - {kind: curve, length: 200 m, radius: -500 m, cant: 60 mm}
"""


def written(tmp_path: Path, text: str, name: str = "line.yaml") -> Path:
    path = tmp_path / name
    path.write_text(text, "utf-8")
    return path


def problems(path: Path) -> list[str]:
    with pytest.raises(FileProblems) as caught:
        load_line(path)
    return [f"{p.line}: {p.key}: {p.message}; {p.remedy}" for p in caught.value.problems]


def test_transitions_are_linear_in_curvature_and_cant(tmp_path: Path) -> None:
    line = load_line(written(tmp_path, LINE))
    at = {float(x): i for i, x in enumerate(line.s.round(6))}
    assert len(line.s) == 3501 and line.s[-1] == pytest.approx(350.0)
    for s, share in ((50.0, 0.0), (100.0, 0.0), (110.0, 0.2), (125.0, 0.5), (150.0, 1.0), (350.0, 1.0)):
        assert line.curvature[at[s]] == pytest.approx(-share / 500.0, abs=1e-12)
        assert line.cant[at[s]] == pytest.approx(-share * 0.06, abs=1e-12)  # the right-hand rail is the outer one
    assert not np.any(line.yw) and line.seed is None


def test_the_gauge_widens_in_a_curve_and_along_its_transitions(tmp_path: Path) -> None:
    text = LINE.replace("cant: 60 mm", "cant: 60 mm, gauge: 15 mm") + "irregularity: fra_5 seed=1\n"
    line, plain = (load_line(written(tmp_path, each)) for each in (text, text.replace(", gauge: 15 mm", "")))
    share = np.clip((line.s - 100.0) / 50.0, 0.0, 1.0)
    np.testing.assert_allclose(line.gauge - plain.gauge, 15e-3 * share, atol=1e-12)
    faulty = written(tmp_path, LINE.replace("length: 100 m", "length: 100 m, gauge: 15 mm"), "faulty.yaml")
    assert "a straight has no gauge" in problems(faulty)[0]


def test_the_plan_of_a_circle_is_a_circle() -> None:
    s = 0.5 * np.arange(201)
    plan = PlanLine(s, np.full(201, 1 / 400.0))
    at = plan.at(np.array([0.0, 33.3, 100.0, 120.0, -10.0]))  # the curve goes on beyond both ends
    x = np.array([0.0, 33.3, 100.0, 120.0, -10.0])
    np.testing.assert_allclose(at.theta, x / 400.0, atol=1e-13)
    np.testing.assert_allclose(at.y, x**2 / 800.0, atol=1e-12)


def test_the_irregularities_are_those_of_the_spectrum(tmp_path: Path) -> None:
    path = written(tmp_path, LINE.replace("200 m", "250 m") + "irregularity: erri_b176_low seed=3\n")
    line = load_line(path)
    track = synthetic_track("erri_b176_low", length=400.1, seed=3)
    np.testing.assert_allclose(line.yw, track.yw, atol=1e-15)
    assert resolve_track(path, seed=4).seed == 4 and resolve_track(path).seed == 3
    assert np.any(resolve_track(path, seed=4).track.yw != line.yw)


def test_the_irregularities_may_come_from_a_file(tmp_path: Path) -> None:
    track = synthetic_track("fra_5", length=400.0, seed=1, spacing=0.25)
    save_track(tmp_path / "rough.csv", track.s, track.yw + 1.0, track.phiw, track.gauge)
    line = load_line(written(tmp_path, LINE + "irregularity: rough.csv\n"))
    assert np.abs(line.yw[::5] - track.yw[: len(line.yw[::5]) * 2 : 2]).max() < 1e-4  # along the mean line
    message = problems(written(tmp_path, LINE.replace("200 m", "400 m") + "irregularity: rough.csv\n"))
    assert "is 399.75 m long, the line 550 m" in message[0]


def test_faults_have_their_line_key_and_remedy(tmp_path: Path) -> None:
    text = LINE.replace("radius: -500 m", "radius: 5 m").replace("length: 50 m", "length: 50 m, cant: 1 mm")
    first, second = problems(written(tmp_path, text))
    assert first == "4: segments.1.cant: a transition has no cant; " + first.partition("; ")[2]
    assert second.startswith("5: segments.2.radius: 5 m is no radius of a line; give 50 m or more")
    (unknown,) = problems(written(tmp_path, LINE.replace("radius", "radus")))
    assert "segments.2.radus: unknown key; did you mean 'radius'" in unknown
    (spectrum,) = problems(written(tmp_path, LINE + "irregularity: erri_b167_low\n"))
    assert spectrum.startswith("6: irregularity") and "erri_b176_low" in spectrum
    assert "is a design" in problems(HOME / "designs/check_bogie.yaml")[0]
    assert "is empty" in problems(written(tmp_path, "segments: []\n"))[0]


def test_a_track_file_may_have_curvature_and_cant(tmp_path: Path) -> None:
    line = load_line(EXAMPLE)
    path = save_track(
        tmp_path / "line.csv", line.s, line.yw, line.phiw, line.gauge, curvature=line.curvature, cant=line.cant
    )
    columns, track = load_track(path), resolve_track(path).track
    np.testing.assert_allclose(columns.curvature, line.curvature, atol=1e-12)
    assert track.has_curves and track.sha256 != resolve_track("erri_b176_low").track.sha256
    beyond = path.read_text().replace("curvature [1/m]", "curvature [1/km]")
    assert load_track(written(tmp_path, beyond, "km.csv")).curvature.max() == pytest.approx(1e-3 / 600.0)
    beyond = path.read_text().replace("cant [m]", "cant [km]")
    with pytest.raises(FileProblems, match=r"more than the 0.3 m that are possible"):
        load_track(written(tmp_path, beyond, "cant.csv"))


def test_a_step_of_the_cant_is_warned_of_with_its_place(tmp_path: Path) -> None:
    """150 mm between two samples: no track bears it, and what the vehicle does there is no property of the vehicle."""
    steps = LINE.replace("  - {kind: transition, length: 50 m}\n", "").replace("60 mm", "150 mm")
    (warning,) = load_line(written(tmp_path, steps)).warnings
    assert (warning.line, warning.key) == (4, "segments.1") and "put a transition there" in warning.remedy
    line = load_line(tmp_path / "line.yaml")
    path = save_track(tmp_path / "line.csv", line.s, line.yw, curvature=line.curvature, cant=line.cant)
    (warning,) = load_track(path).warnings
    assert warning.key == "cant" and warning.message == "changes by 150 mm over 3 m at 100 m"
    assert any("150 mm over 3 m" in note for note in resolve_track(path).notes)
    assert any("150 mm over 3 m" in note for note in resolve_track(tmp_path / "line.yaml").notes)
    assert load_line(written(tmp_path, LINE, "even.yaml")).warnings == load_line(EXAMPLE).warnings == ()


def test_a_cant_at_the_inner_rail_is_warned_of(tmp_path: Path) -> None:
    line = load_line(written(tmp_path, LINE))
    path = save_track(tmp_path / "line.csv", line.s, line.yw, curvature=line.curvature, cant=-line.cant)
    (warning,) = load_track(path).warnings
    assert "inner rail" in warning.message and warning.line > 1000


def test_a_radius_is_refused_and_other_columns_are_named_as_unused(tmp_path: Path) -> None:
    rows = "".join(f"{0.5 * i},0,500\n" for i in range(200))
    with pytest.raises(FileProblems, match=r"no column radius, write `curvature \[1/m\]`"):
        load_track(written(tmp_path, "s [m],yw [m],radius [m]\n" + rows, "radius.csv"))
    (warning,) = load_track(written(tmp_path, "s [m],yw [m],Cant [mm]\n" + rows, "case.csv")).warnings
    assert (warning.key, warning.remedy) == ("Cant", "did you mean 'cant'?")


def test_a_run_with_curvature_and_cant_is_a_line(tmp_path: Path) -> None:
    line = resolve_track(EXAMPLE).track
    t = line.s / 25.0
    columns = {"t [s]": t, "v [m/s]": 25.0 + 0 * t, "yw [m]": line.yw}
    columns |= {"curvature [1/km]": 1e3 * line.curvature, "cant [mm]": 1e3 * line.cant}
    track = resolve_track(write_table(tmp_path / "run.csv", columns)).track
    for name in ("curvature", "cant"):
        expected = np.interp(track.s, line.s, getattr(line, name))
        np.testing.assert_allclose(getattr(track, name), expected, atol=1e-6)
    columns["cant [mm]"] = np.where(t < 20.0, columns["cant [mm]"], np.nan)
    with pytest.raises(FileProblems, match="rows of the longest segment have no value"):
        resolve_track(write_table(tmp_path / "gap.csv", columns))


def test_the_cant_deficiency_is_positive_outward_in_both_curves() -> None:
    track = resolve_track(EXAMPLE).track
    deficiency = cant_deficiency(track, 25.0, 0.75)
    for radius, cant, side in ((600.0, 0.1, 1), (450.0, 0.12, -1)):
        inside = np.isclose(track.curvature, side / radius)
        assert np.count_nonzero(inside) > 3000
        np.testing.assert_allclose(deficiency[inside], 1.5 * 625.0 / (9.81 * radius) - cant, rtol=1e-9)


def test_the_commands_take_a_line(tmp_path: Path) -> None:
    assert recognise(EXAMPLE) == "line"
    run = CliRunner().invoke(cli, ["check", str(EXAMPLE)])
    assert run.exit_code == 0, run.output
    shown = CliRunner().invoke(cli, ["schema", "line"])
    assert "segments" in shown.output
    line = written(tmp_path, LINE + "irregularity: erri_b176_low seed=1\n")
    bogie = str(HOME / "designs/test_bogie.yaml")
    ride = CliRunner().invoke(cli, ["ride", bogie, "--track", str(line), "--speed", "25"])
    assert ride.exit_code == 0, ride.output
    assert "cant deficiency" in ride.output and "500" in ride.output
    zones = ["assess", str(line), bogie, "--speed", "25", "--method", "en14363"]
    shown = CliRunner().invoke(cli, zones)
    assert "zone 3" in shown.output and "straight, test zones" not in shown.output


def test_a_study_may_have_a_line_as_its_track(tmp_path: Path) -> None:
    written(tmp_path, LINE + "irregularity: erri_b176_low seed=1\n")
    study = f"""
vehicle: {HOME / "designs/test_bogie.yaml"}
variables: {{vehicle.secondary.lateral_stiffness: [1e5, 1e6]}}
cases: {{track: line.yaml, speed: 25 m/s}}
objectives: [{{minimise: largest_derailment_quotient}}]
"""
    loaded = load_study(written(tmp_path, study, "study.yaml"))
    case = cases_of(loaded)[0]
    assert case.excitation.track.has_curves and case.excitation.source.seed == 1
    with pytest.raises(FileProblems, match="no file"):
        load_study(written(tmp_path, study.replace("line.yaml", "lime.yaml"), "study.yaml"))
