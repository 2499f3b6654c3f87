"""Files of a state space: NumPy's .npz and MATLAB's .mat, with equal bytes for equal contents."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.io.atomic import write_bytes
from railui.vehicle.state_space import StateSpace

SUFFIXES: Final = (".npz", ".mat")
MAT_TEXT_BYTES: Final = 116  # of the header of a MAT-file of level 5, in which scipy writes the date
MAT_TEXT: Final = b"MATLAB 5.0 MAT-file, state space of a railway vehicle written by railui"
TEXTS: Final = ("states", "inputs", "outputs", "state_units", "input_units", "output_units")


def check_state_space_file(path: str | Path) -> None:
    """Raise ValueError for a name that does not end in .npz or .mat."""
    if not str(path).lower().endswith(SUFFIXES):
        raise ValueError(f"{str(path)!r} is not a file of a state space: write a name that ends in .npz or .mat")


def write_state_space(path: str | Path, space: StateSpace) -> Path:
    """Write a state space atomically: A, B, C, D, speed, delays, and names and units of states, inputs and outputs.

    Names are arrays of text in .npz and cell arrays in .mat.

    Raises
    ------
    ValueError
        For a name that does not end in .npz or .mat.
    """
    check_state_space_file(path)
    out = io.BytesIO()
    if str(path).lower().endswith(".npz"):
        arrays: dict[str, Any] = {key: np.asarray(value) for key, value in space.arrays().items()}
        np.savez(out, **arrays)
        return write_bytes(path, out.getvalue())
    from scipy.io import savemat

    contents = {key: _cells(value) if key in TEXTS else value for key, value in space.arrays().items()}
    stream: Any = out  # of which the stubs know nothing
    savemat(stream, contents, oned_as="row")
    content = bytearray(out.getvalue())
    content[:MAT_TEXT_BYTES] = MAT_TEXT.ljust(MAT_TEXT_BYTES)
    return write_bytes(path, bytes(content))


def _cells(texts: list[str]) -> Any:
    """Return texts as an array of objects, which becomes a cell array."""
    cells = np.empty(len(texts), dtype=object)
    cells[:] = texts
    return cells
