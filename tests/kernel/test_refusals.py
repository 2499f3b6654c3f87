"""Arguments that do not fit a vehicle are rejected at the interface, since the kernel does not check bounds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from railui.core import Batch, Placement, Vehicles, effect_numbers
from tests.kernel.pairs import asymmetric_bogie, batch, interval, structure, tangent_run

VEHICLE = asymmetric_bogie(40)
RUN = tangent_run(1.2)
MADE, ONE, T = structure(VEHICLE), batch([VEHICLE]), interval(RUN)
TABLE = np.column_stack([np.zeros(201), np.full(201, 40.0), np.zeros((201, 12))])
CHANNELS = ("e1", "e2", "ayf")


def curve(kind: str, at: str, values: dict[str, list[float]]) -> None:
    """Ask for the steps of a bogie with a curve of these points."""
    numbers = effect_numbers(kind, values)
    made = Vehicles("bogie", [Placement(kind, at, None, len(numbers))])
    made.required_steps(Batch.from_arrays(ONE.numbers, np.array([numbers]), np.ones((1, 1))), 40.0, 40.0, T)


def light() -> None:
    numbers = ONE.numbers.copy()
    numbers[0, 2] = 1e-45
    MADE.required_steps(Batch.from_arrays(numbers), 40.0, 40.0, T)


def score(clearance: int = 1, cascades: tuple[np.ndarray, ...] = (), states: int = 12) -> None:
    MADE.ride_statistics(ONE.with_initial_states(np.zeros(states)), TABLE, T, 1, CHANNELS, np.ones(clearance), cascades)


REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "a curve of two lengths": (
        lambda: curve("measured_force", "frame", {"motion": [0, 1, 2], "force": [1.0]}),
        "measured_force is not described by 5 numbers",
    ),
    "a curve without points": (lambda: curve("measured_force", "frame", {"motion": [], "force": []}), "by 1 numbers"),
    "a profile that falls": (
        lambda: curve(
            "profile_shape",
            "contact",
            {"displacement": [1, 0], "radius": [0, 0], "radius_per_gauge": [0, 0], "angle": [0, 0]},
        ),
        "profile_shape is not described by 9 numbers",
    ),
    "a mass of nothing": (light, "needs .*e.* steps per sample"),
    "a clearance too few": (lambda: score(clearance=0), "clearances: 0 given, 1 expected"),
    "a section of four numbers": (lambda: score(cascades=(np.ones((1, 1, 4)),)), r"\[vehicle, section, 6\]"),
    "a state too many": (lambda: score(states=13), "initial states: 13 given, 12 expected"),
    "a curve against nothing known": (
        lambda: Vehicles("bogie", [Placement("measured_force", "frame", None, 5, "a")]),
        'measured_force has no curve against "a"',
    ),
    "a choice where there is none": (
        lambda: Vehicles("bogie", [Placement("spring", "primary_lateral", None, 1, "v")]),
        'spring has no curve against "v"',
    ),
    "an input of a bogie": (lambda: Vehicles("bogie", rig_input="force"), 'kind "bogie" has no input "force"'),
    "an input that no rig has": (lambda: Vehicles("rig", rig_input="torque"), 'kind "rig" has no input "torque"'),
    "a third wheelset": (
        lambda: Vehicles("bogie", [Placement("flange_contact", "contact", 3)]).state_count(
            Batch.from_arrays(ONE.numbers, np.array([[7e-3, 1e7, 0.0, 0.01, 1.2]]), np.ones((1, 1)))
        ),
        'no place "contact" for wheelset 3',
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_a_faulty_definition_is_rejected_with_a_message(what: str) -> None:
    ask, says = REFUSED[what]
    with pytest.raises(ValueError, match=says):
        ask()


def test_more_threads_than_any_machine_has_do_not_stop_it() -> None:
    alone, _ = MADE.simulate(ONE, TABLE, T, 1, CHANNELS, jobs=1)
    crowded, _ = MADE.simulate(ONE, TABLE, T, 1, CHANNELS, jobs=100_000)
    assert np.array_equal(alone, crowded)
