"""Arrays of messages and memory maps: at addresses that are no multiple of 8, read-only, strided, of other machines."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.core import Batch, Spline, ZeroPhaseFilter, sosfilt
from tests.kernel.pairs import Floats, asymmetric_bogie, batch, interval, structure, table, tangent_run

RUN, BOGIE = tangent_run(), asymmetric_bogie()
VEHICLES, ROWS, TABLE = structure(BOGIE), batch([BOGIE]), table(RUN, BOGIE.a, 1)
SECTIONS = np.array([[0.2, 0.1, 0.0, 1.0, -0.7, 0.0]])
STATES = np.linspace(1e-4, 2e-4, VEHICLES.state_count(ROWS))[None]
Change = Callable[[Floats], Any]


def misaligned(array: Floats) -> Floats:
    """Return the array in a message, behind one byte of something else; read-only."""
    return np.frombuffer(bytes(1) + array.tobytes(), array.dtype, offset=1).reshape(array.shape)


def strided(array: Floats) -> Floats:
    """Return the array as every second item of another one."""
    return np.repeat(array, 2, axis=-1)[..., ::2]


def swapped(array: Floats) -> Any:
    """Return the array in the byte order of other machines."""
    return array.astype(array.dtype.newbyteorder())


def simulated(change: Change) -> Floats:
    passed = ZeroPhaseFilter(change(SECTIONS), change(np.zeros((1, 2))), 6, 0, change(np.ones(1)))
    vehicles = Batch.from_arrays(change(ROWS.numbers), initial=change(STATES), speed_scale=change(np.ones(1)))
    return VEHICLES.simulate(vehicles, change(TABLE), interval(RUN), 1, ["e1"], filter=passed)[0]


def statistics(change: Change) -> Floats:
    cascade = change(np.broadcast_to(SECTIONS, (1, *SECTIONS.shape)))
    found = VEHICLES.ride_statistics(
        ROWS, change(TABLE), interval(RUN), 1, ["e1", "e2", "ayf"], change(np.array([7e-3])), [cascade]
    )
    return found.rms


def added(change: Change) -> Floats:
    rows = np.array([[0.0, 10.0, 0.0], [2.0, 10.0, 0.0]])
    if change is strided:  # writable, as all tables to which something is added
        rows = strided(rows)
    Spline(np.arange(4.0), 3.0 * np.arange(4.0)).add_behind(rows, 1.0, [(1, 2)])
    return rows


ENTRIES: dict[str, Callable[[Change], Floats]] = {
    "spline": lambda change: Spline(change(RUN.s), change(RUN.yw))(change(RUN.s[5:9] + 0.01)),
    "add_behind": added,
    "sosfilt": lambda change: sosfilt(change(SECTIONS), change(RUN.yw[None]), change(np.zeros((1, 1, 2)))),
    "simulate": simulated,
    "ride_statistics": statistics,
    "state_derivatives": lambda change: VEHICLES.state_derivatives(ROWS, change(TABLE[3]), change(STATES)),
    "jacobians": lambda change: VEHICLES.jacobians(ROWS, change(TABLE[3])),
    "static_forces": lambda change: VEHICLES.static_forces(
        ROWS.with_initial_states(change(STATES)), change(TABLE[3:4]), change(np.zeros(1))
    )[0],
}


@pytest.mark.parametrize("change", [misaligned, strided, swapped])
@pytest.mark.parametrize("entry", ENTRIES)
def test_an_entry_of_the_kernel_takes_an_array_of_any_layout(entry: str, change: Change) -> None:
    np.testing.assert_array_equal(ENTRIES[entry](change), ENTRIES[entry](np.array))


def test_a_read_only_memory_map_is_read(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(bytes(3) + RUN.s.tobytes())
    mapped = np.memmap(tmp_path / "x", float, "r", offset=3, shape=RUN.s.shape)
    assert not mapped.flags.aligned
    np.testing.assert_array_equal(Spline(mapped, RUN.yw)(RUN.s), Spline(RUN.s, RUN.yw)(RUN.s))
