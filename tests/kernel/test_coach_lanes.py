"""A coach gives identical digits alone, in every lane, on any number of threads, and with richer neighbours."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from railui.bench.standard_job import bogie_model, coach_model
from railui.core import Batch
from railui.track.excitation import Excitation, resolve_track
from railui.vehicle.kernel_rows import parameter_paths
from railui.vehicle.model import Model

Floats = NDArray[np.float64]

MODEL = coach_model()
ROAD = Excitation(resolve_track("erri_b176_high length=60 seed=3"), 45.0)
TABLE = ROAD.table(MODEL.wheelset_spacing(), 1)
CHANNELS = [*MODEL.vehicles().degrees_of_freedom(MODEL.single_batch()), "e1", "e4"]
# small values of the parameters that the coach of the standard job lacks
MORE = {"yaw_stiffness": 2e5, "roll_stiffness": 2e4, "longitudinal_damping": 5e3, "lateral_damping": 4e3}
MORE |= {"yaw_damping": 3e3, "roll_damping": 2e3, "vertical_damping": 3e3}
# parameters that are zero or changed in the neighbouring coach
LESS = {
    "no anti-roll bar": "vehicle.elements.anti_roll_bar.stiffness",
    "no vertical dampers": "vehicle.elements.secondary_damper.vertical_damping",
    "no lateral dampers": "vehicle.elements.lateral_damper.lateral_damping",
    "no bump stops": "vehicle.elements.bump_stop.stiffness",
    "secondary springs on the rails": "vehicle.elements.secondary.height",
    "no longitudinal stiffness": "vehicle.elements.secondary.longitudinal_stiffness",
    "no spin creep": "contact.spin_creep",
    "no gyroscopic moments": "vehicle.elements.wheelset.spin_inertia",
}


def poor(what: str) -> Floats:
    """The row of a coach without one thing."""
    row = MODEL.row.copy()
    row[MODEL.columns[LESS[what]]] = 0.0
    return row


def rich(seed: int) -> Floats:
    """The row of a coach whose every element has everything, and of other numbers."""
    row = MODEL.row * (1.0 + 0.1 * np.random.default_rng(seed).uniform(-1.0, 1.0, len(MODEL.row)))
    for path, column in MODEL.columns.items():
        if row[column] == 0.0 and path.startswith("vehicle.elements."):
            row[column] = MORE[path.rpartition(".")[2]]
    return row


def series(rows: list[Floats], jobs: int = 1) -> Floats:
    """[vehicle, channel, sample]."""
    found, lost = MODEL.vehicles().simulate(MODEL.batch(np.stack(rows)), TABLE, ROAD.dt, 1, CHANNELS, jobs=jobs)
    assert (lost == -1).all()
    return found


@cache
def alone(what: str) -> Floats:
    return series([poor(what)])[0]


@pytest.mark.parametrize("what", LESS)
def test_neighbours_with_more_elements_do_not_change_a_coach(what: str) -> None:
    assert np.array_equal(series([rich(1), poor(what), rich(2)])[1], alone(what))


def test_coaches_of_different_elements_do_not_change_each_other() -> None:
    found = series([poor(what) for what in LESS] + [rich(k) for k in range(9)])
    for k, what in enumerate(LESS):
        assert np.array_equal(found[k], alone(what)), what


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_coach_has_the_same_digits_in_every_lane(jobs: int) -> None:
    rows = [rich(k) for k in range(19)]
    order = np.random.default_rng(0).permutation(len(rows))
    assert np.array_equal(series([rows[k] for k in order], jobs), series(rows)[order])


@pytest.mark.parametrize("model", [MODEL, bogie_model()], ids=["coach", "bogie"])
@pytest.mark.parametrize("friction", [0.35, 0.03], ids=["creeping", "sliding"])
def test_neighbours_with_other_amounts_of_saturation_do_not_change_a_vehicle(model: Model, friction: float) -> None:
    own, rows = len(parameter_paths(model.design)), np.tile(model.row, (3, 1))
    rows[:, [column for path, column in model.columns.items() if path.endswith(".friction")]] = friction
    shares = np.array([[1.0, 1.0], [0.5, 1.0], [0.0, 1.0]])  # of the saturation, of the flange

    def found(which: list[int]) -> Floats:
        batch = Batch.from_arrays(rows[which, :own], rows[which, own:], shares[which])
        return model.vehicles().simulate(batch, ROAD.table(model.wheelset_spacing(), 1), ROAD.dt, 1, ["e1"])[0]

    together = found([0, 1, 2])
    assert all(np.array_equal(together[k], found([k])[0]) for k in range(3))
    assert not np.array_equal(together[0], together[1])


def test_removing_an_element_changes_the_motion_of_a_coach() -> None:
    standard = series([MODEL.row])[0]
    assert [what for what in LESS if np.array_equal(alone(what), standard)] == ["no bump stops"]
