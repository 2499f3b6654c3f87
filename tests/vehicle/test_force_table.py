"""Force tables: the same vehicle as a linear damper, the force between the points, and problems with their place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.campaign.dataset import Segment
from railui.core import Batch, Placement, Vehicles
from railui.documents.check import check
from railui.documents.recognise import recognise
from railui.io.problems import FileProblems
from railui.ride_quality.evaluation import ride
from railui.running_stability.summary import stability
from railui.vehicle.design_reader import load_design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import effect_row

BOGIE = Path(__file__).parents[2] / "designs" / "test_bogie.yaml"
TRACK = "erri_b176_low length=300 seed=1"
UNDAMPED = BOGIE.read_text("utf-8").replace("lateral_damping: 30 kN*s/m", "lateral_damping: 0")
LINEAR = "{damper: {velocity: [-2, 2], force: [-60 kN, 60 kN]}}"


def design(folder: Path, element: str, at: str = "secondary_lateral", text: str = UNDAMPED, more: str = "") -> Path:
    """Write a design that mounts an element."""
    path = folder / "bogie.yaml"
    path.write_text(f"{text}effects:\n  - {{element: {element}, at: {at}{more}}}\n")
    return path


def forces(effects: tuple[PlacedEffect, ...], z: np.ndarray, dt: float) -> np.ndarray:
    """Return the force of effects on a bench that prescribes their motion."""
    placed = [Placement(e.kind, "rig", None, len(effect_row(e)), e.against) for e in effects]
    vehicles = Vehicles("rig", placed, rig_input="motion")
    tail = np.array([[x for e in effects for x in effect_row(e)]])
    batch = Batch.from_arrays(np.zeros((1, 3)), tail, np.ones((1, len(effects))))
    t = np.arange(len(z)) * dt
    segment = Segment("", "", 0, {"t": t, "z": z, "F": np.zeros_like(z)}, dt, "bench")
    steps = vehicles.required_steps(batch, 1.0, 1.0, dt)[0]
    series = vehicles.simulate(batch, segment.table(0.0, steps), dt, steps, ["F"])[0]
    return np.asarray(series[0, 0])


def test_a_straight_table_is_the_linear_damper_of_the_same_constant(tmp_path: Path) -> None:
    """30 kN s/m as lateral_damping, and as a table of 60 kN at 2 m/s: the same ride and the same critical speed."""
    assert "lateral_damping: 0" in UNDAMPED
    table = design(tmp_path, LINEAR)
    expected, found = ride(BOGIE, TRACK, 40.0), ride(table, TRACK, 40.0)
    for key in ("score", "weighted_acceleration", "flange_margin"):
        assert found[key] == pytest.approx(expected[key], rel=1e-9)
    critical = [stability(each, [40.0, 80.0])["linear_critical_speed"] for each in (BOGIE, table)]
    assert critical[1] == pytest.approx(critical[0], rel=1e-7)
    twice = load_design(design(tmp_path, LINEAR, more=", count: 2")).effects[0]
    assert twice.parameters["force"] == (120e3, -120e3) and twice.parameters["motion"] == (-2.0, 2.0)


def test_the_force_is_linear_between_the_points_and_constant_beyond(tmp_path: Path) -> None:
    element = "{damper: {velocity: [-0.3, -0.1, 0, 0.1, 0.3], force: [-4000, -2500, 0, 1500, 2000]}}"
    z = 0.05 * np.sin(10.0 * np.arange(2000) * 1e-3)
    v = 0.5 * np.cos(10.0 * np.arange(2000) * 1e-3)
    found = forces(load_design(design(tmp_path, element)).effects, z, 1e-3)
    expected = np.interp(v, [-0.3, -0.1, 0, 0.1, 0.3], [-4000, -2500, 0, 1500, 2000])
    assert np.abs(found - expected)[2:-2].max() < 5.0


def test_lists_a_csv_and_a_file_of_an_element_are_the_same_table(tmp_path: Path) -> None:
    (tmp_path / "damper.csv").write_text("# bench\nv [mm/s],F [kN]\n-300,-4\n-100,-2.5\n0,0\n100,1.5\n300,2\n")
    (tmp_path / "damper.yaml").write_text("schema: railui.element/1\ndamper: {file: damper.csv}\n")
    listed = "{damper: {velocity: [-300 mm/s, -0.1, 0, 0.1, 0.3], force: [-4 kN, -2500, 0, 1500, 2000]}}"
    tables = [load_design(design(tmp_path, each)).effects for each in (listed, "damper.csv", "damper.yaml")]
    for effects in tables:
        assert [(e.kind, e.at, e.against) for e in effects] == [("measured_force", "secondary_lateral", "v")]
        np.testing.assert_allclose(effects[0].parameters["force"], [4000, 2500, 0, -1500, -2000], atol=1e-9)
        np.testing.assert_allclose(effects[0].parameters["motion"], [-0.3, -0.1, 0, 0.1, 0.3], atol=1e-12)
    assert recognise(tmp_path / "damper.csv") == "element"
    assert check([tmp_path / "damper.csv", tmp_path / "damper.yaml", tmp_path / "bogie.yaml"]) == []


def test_one_side_of_a_symmetric_table_is_mirrored(tmp_path: Path) -> None:
    element = "{damper: {velocity: [0, 0.1, 0.3], force: [0, 1500, 2000], symmetric: true}}"
    parameters = load_design(design(tmp_path, element, "primary_lateral", more=", wheelset: 2")).effects[0].parameters
    assert parameters["motion"] == (-0.3, -0.1, 0.0, 0.1, 0.3)
    assert parameters["force"] == (2000.0, 1500.0, -0.0, -1500.0, -2000.0)


def test_a_yaw_damper_is_a_table_of_moments(tmp_path: Path) -> None:
    damper, spring = "{velocity: [-1, 1], force: [-5 kN*m, 5 kN*m]}", "{displacement: [-1, 1], force: [-2, 2]}"
    element = f"{{motion: rad, damper: {damper}, spring: {spring}}}"
    effects = load_design(design(tmp_path, element, "secondary_yaw")).effects
    assert [(e.against, e.parameters["force"]) for e in effects] == [("v", (5e3, -5e3)), ("z", (2.0, -2.0))]
    (tmp_path / "yaw.csv").write_text("v [rad/s],F [kN*m]\n-1,-5\n1,5\n")
    assert load_design(design(tmp_path, "yaw.csv", "secondary_yaw")).effects[0].parameters["force"] == (5e3, -5e3)
    with pytest.raises(FileProblems, match="moves in rad, but the motion at secondary_lateral is a displacement"):
        load_design(design(tmp_path, "yaw.csv"))


@pytest.mark.parametrize(
    ("damper", "key", "message"),
    [
        ("{velocity: [-1, 1]}", "damper", "has no force"),
        ("{velocity: [-1, 1], force: [-2, 1, 2]}", "damper.force", "has 3 values, velocity has 2"),
        ("{velocity: [-1, x], force: [-1, 1]}", "damper.velocity.1", "x"),
        ("{velocity: [-1, 1 m], force: [-1, 1]}", "damper.velocity.1", "'1 m' has the unit m"),
        ("{velocity: [1, -1], force: [-1, 1]}", "damper.velocity.1", "velocity does not increase"),
        ("{velocity: [0, 1], force: [0, 1]}", "damper.velocity", "no negative velocity.*`symmetric: true`"),
        ("{velocity: [-1, 1], force: [1, -1]}", "damper.force", "drives the motion.*change the sign"),
        ("{velocity: [-1, 1], force: [-1, 1], symmetric: true}", "damper.velocity.0", "negative velocity"),
        ("{velocity: [0, 1], force: [1, 2], symmetric: true}", "damper.force.0", "is 0 at 0"),
        ("{velocity: [0], force: [0]}", "damper.velocity", "has 1 points, give 2 to 200"),
        ("{speed: [-1, 1], force: [-1, 1]}", "damper.speed", "unknown key of a table"),
        ("{file: d.csv, force: [1]}", "damper.force", "leave one of them out"),
        ("{file: absent.csv}", "damper.file", "no file 'absent.csv'"),
        ("[1, 2]", "damper", "is not a table"),
    ],
)
def test_a_problem_of_a_list_has_its_line_key_and_remedy(tmp_path: Path, damper: str, key: str, message: str) -> None:
    path = design(tmp_path, f"{{damper: {damper}}}")
    with pytest.raises(FileProblems, match=message) as error:
        load_design(path)
    problem = error.value.problems[0]
    assert problem.key == f"effects.0.element.{key}" and problem.remedy
    assert problem.line == len(UNDAMPED.splitlines()) + 2 and problem.file == str(path)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("v [m/s],F [N]\n-1,-5\n0,0\n-0.5,2\n", 4, "velocity does not increase"),
        ("v [m/s],F [N]\n-1,-5\n0,\n1,2\n", 3, "is not a number"),
        ("v [m/s],F [N]\n-1,5\n1,-5\n", 1, "drives the motion"),
        ("v [kg],F [N]\n-1,-5\n1,5\n", 1, "no unit of a velocity"),
        ("v [m/s],F [m]\n-1,-5\n1,5\n", 1, "m is not N"),
        ("v [m/s],G [N]\n-1,-5\n1,5\n", 1, "has no column F"),
        ("t [s],z [m],F [N]\n0,0,0\n1,0,0\n", 1, "is a recording over time, not a table"),
    ],
)
def test_a_problem_of_a_csv_has_its_line(tmp_path: Path, text: str, line: int, message: str) -> None:
    (tmp_path / "damper.csv").write_text(text)
    with pytest.raises(FileProblems, match=message) as error:
        load_design(design(tmp_path, "damper.csv"))
    problem = error.value.problems[0]
    assert (problem.line, problem.file) == (line, str(tmp_path / "damper.csv")) and problem.remedy
