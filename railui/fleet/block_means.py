"""File of the block means of a fleet: what was measured and what was expected, by vehicle and quantity."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.io.atomic import write_bytes
from railui.io.problems import file_problem

BLOCK_MEANS: Final = "fleet.npz"


@dataclass(frozen=True, eq=False)
class BlockMeans:
    """Means of the blocks of all vehicles of a type, in the units of the quantities.

    Attributes
    ----------
    type
        Name of the vehicle type.
    vehicles, quantities, units
        Names and units of the axes of the arrays.
    start
        First day of each block, and the end of the last one [block + 1].
    value, expected, sd
        Mean corrected for temperature, load and sisters, its prediction from the blocks before, and the standard
        deviation of the difference [block, vehicle, quantity]; NaN: no run.
    largest_sum
        Largest sum of the sequential test over its threshold [vehicle, quantity]; falls are negative.
    """

    type: str
    vehicles: tuple[str, ...]
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    start: FloatArray
    value: FloatArray
    expected: FloatArray
    sd: FloatArray
    largest_sum: FloatArray

    @property
    def middle(self) -> FloatArray:
        """Middle day of each block."""
        return np.asarray(0.5 * (self.start[:-1] + self.start[1:]))


def write_block_means(all_means: Sequence[BlockMeans], path: Path) -> None:
    """Write the block means of all vehicle types as a NumPy archive, whose arrays are named TYPE/NAME."""
    arrays: dict[str, NDArray[np.generic]] = {}
    for means in all_means:
        for field in fields(means)[1:]:
            arrays[f"{means.type}/{field.name}"] = np.asarray(getattr(means, field.name))
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    write_bytes(path, buffer.getvalue())


def read_block_means(path: Path) -> list[BlockMeans]:
    """Read the block means of all vehicle types; FileProblems for a missing or damaged file."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        types = dict.fromkeys(name.rpartition("/")[0] for name in arrays)
        return [_means_of(arrays, name) for name in types]
    except FileNotFoundError:
        raise file_problem(path, "does not exist", "run `railui fleet run` first") from None
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise file_problem(path, f"cannot be read: {error}", "run `railui fleet run` again") from error


def _means_of(arrays: dict[str, NDArray[np.generic]], name: str) -> BlockMeans:
    def texts(key: str) -> tuple[str, ...]:
        return tuple(str(text) for text in arrays[f"{name}/{key}"])

    def numbers(key: str) -> FloatArray:
        return np.asarray(arrays[f"{name}/{key}"], dtype=float)

    return BlockMeans(
        name,
        texts("vehicles"),
        texts("quantities"),
        texts("units"),
        *(numbers(key) for key in ("start", "value", "expected", "sd", "largest_sum")),
    )
