"""JSON document of a result: version, inputs with their hashes and seed, then the data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


def json_document(
    kind: str, body: Mapping[str, Any], inputs: Sequence[str | Path] = (), seed: int | None = None
) -> dict[str, Any]:
    """Return the JSON document of a command.

    Parameters
    ----------
    kind : str
        Name of the command.
    body : mapping
        Data of the result.
    inputs : sequence of str or Path
        Files that were read.
    seed : int, optional
        Seed of the random numbers.

    Returns
    -------
    dict
        schema, version, inputs, seed, simd, then the data; every number finite or None.
    """
    import railui
    from railui.core import simd_level
    from railui.io.atomic import to_json_value

    envelope = {
        "schema": f"railui.{kind}/1",
        "version": railui.__version__,
        "inputs": [{"file": str(path), "sha256": sha256_or_none(path)} for path in inputs],
        "seed": seed,
        "simd": simd_level(),
    }
    return {**envelope, **to_json_value(dict(body))}


def sha256_or_none(path: str | Path) -> str | None:
    """Return the SHA-256 of a file, None where it cannot be read, or is a pipe or device."""
    from railui.io.atomic import sha256_file

    if not Path(path).is_file():
        return None
    try:
        return sha256_file(path)
    except OSError:
        return None
