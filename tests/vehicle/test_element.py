"""Elements: the law of a bench in a design, with the same force, and errors that name file, key and remedy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.campaign.segment import Segment
from railui.core import Batch, Placement, Vehicles
from railui.documents.check import check
from railui.identification.prediction import Predictor
from railui.io.problems import FileProblems
from railui.ride_quality.evaluation import ride
from railui.vehicle.design_reader import load_design
from railui.vehicle.effects import kernel_catalogue
from railui.vehicle.element import load_element
from railui.vehicle.kernel_rows import effect_row
from railui.vehicle.model import Model

BOGIE = Path(__file__).parents[2] / "designs" / "test_bogie.yaml"
ELEMENT = """\
schema: railui.element/1
name: damper
stiffness: 3 kN/m
damping: 2 kN*s/m
preload: 40 N
effects:
  - {kind: dry_friction, force: 300 N, slip_speed: 10 mm/s}
  - {kind: hysteresis, stiffness: 400 kN/m, yield: 150 N}
"""
DT = 0.002
T = np.arange(1500) * DT
Z = 0.01 * np.sin(7.0 * T)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "damper.yaml").write_text(ELEMENT)
    (tmp_path / "bogie.yaml").write_text(
        BOGIE.read_text("utf-8") + "effects: [{element: damper.yaml, at: secondary_lateral, count: 2}]\n"
    )
    return tmp_path


def test_an_element_in_a_design_has_the_force_of_the_bench(folder: Path) -> None:
    bench = load_design(
        "vehicle: {rig: {input: motion, stiffness: 3 kN/m, damping: 2 kN*s/m, preload: 40 N}}\n"
        "effects:\n"
        "  - {kind: dry_friction, force: 300, slip_speed: 0.01}\n"
        "  - {kind: hysteresis, stiffness: 400000, yield: 150}\n"
    )
    segment = Segment("", "", 0, {"t": T, "z": Z, "F": np.zeros_like(Z)}, DT, "bench")
    measured = Predictor(Model(bench), segment).simulate()[0][0, 0]
    mounted = load_design(folder / "bogie.yaml").effects
    assert {e.at for e in mounted} == {"secondary_lateral"}
    placed = [Placement(e.kind, "rig", None, len(effect_row(e)), e.against) for e in mounted]
    vehicles = Vehicles("rig", placed, rig_input="motion")
    tail = np.array([[x for e in mounted for x in effect_row(e)]])
    batch = Batch.from_arrays(np.zeros((1, 3)), tail, np.ones((1, len(mounted))))
    steps = vehicles.required_steps(batch, 1.0, 1.0, DT)[0]
    force = vehicles.simulate(batch, segment.table(0.0, steps), DT, steps, ["F"])[0][0, 0]
    assert np.abs(force - 2.0 * measured).max() < 1e-3 * np.abs(force).max()


def test_a_design_with_an_element_rides_otherwise_than_without(folder: Path) -> None:
    track = "erri_b176_low length=300"
    bare, mounted = ride(BOGIE, track, 40.0), ride(folder / "bogie.yaml", track, 40.0)
    assert np.isfinite(mounted["score"]) and mounted["score"] != bare["score"]


def test_check_accepts_elements_and_designs_that_mount_them(folder: Path) -> None:
    assert check([folder / "damper.yaml", folder / "bogie.yaml"]) == []


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{element: dampr.yaml, at: secondary_lateral}", "no file 'dampr.yaml'"),
        ("{element: damper.yaml}", "has no location"),
        ("{element: damper.yaml, at: secondary_latral}", "not possible at 'secondary_latral'"),
        ("{element: damper.yaml, at: secondary_yaw}", "is a rotation"),
        ("{element: damper.yaml, at: secondary_lateral, count: 0}", "carry no force"),
        ("{element: damper.yaml, at: secondary_lateral, number: 2}", "unknown key"),
    ],
)
def test_a_wrong_entry_is_reported_with_its_place(folder: Path, entry: str, message: str) -> None:
    (folder / "bogie.yaml").write_text(BOGIE.read_text("utf-8") + f"effects:\n  - {entry}\n")
    with pytest.raises(FileProblems, match=message) as error:
        load_design(folder / "bogie.yaml")
    assert error.value.problems[0].line == len(BOGIE.read_text("utf-8").splitlines()) + 2


def test_a_law_with_a_location_in_an_element_is_an_error(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("schema: railui.element/1\neffects: [{kind: spring, at: frame, stiffness: 3}]\n")
    with pytest.raises(FileProblems, match="no location of its own"):
        load_element(file, kernel_catalogue())
