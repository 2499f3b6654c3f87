"""Store of the information of runs: computed once, read again for any budget, any costs and after an interruption."""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui import core
from railui.io.atomic import write_bytes
from railui.planning.run_information import RunInformation

ARRAYS: Final = tuple(f.name for f in fields(RunInformation) if f.name not in ("channels", "samples"))
SUFFIX: Final = ".npz"
FORMAT: Final = 1  # of the files


@dataclass(frozen=True)
class InformationStore:
    """Files of a directory, one for every run, named by the hash of everything that its numbers depend on."""

    directory: Path

    def read(self, key: str) -> tuple[RunInformation, NDArray[np.bool_]] | None:
        """Return the information of a run and which shapes are valid; None where it is not stored, or damaged."""
        try:
            with np.load(self._file(key), allow_pickle=False) as found:
                arrays: dict[str, Any] = {name: found[name] for name in ARRAYS}
                channels = tuple(found["channels"].tolist())
                return RunInformation(channels=channels, samples=int(found["samples"]), **arrays), found["valid"]
        except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
            return None

    def write(self, key: str, run: RunInformation, valid: NDArray[np.bool_]) -> None:
        """Write the information of a run, atomically."""
        self.directory.mkdir(parents=True, exist_ok=True)
        out = io.BytesIO()
        arrays: dict[str, Any] = {name: getattr(run, name) for name in ARRAYS}
        np.savez(out, channels=np.array(run.channels), samples=run.samples, valid=valid, **arrays)
        write_bytes(self._file(key), out.getvalue())

    def _file(self, key: str) -> Path:
        return self.directory / f"run_{key[:24]}{SUFFIX}"


def content_key(parts: Iterable[object]) -> str:
    """Return the SHA-256 of arrays by their bytes, of anything else by its representation, and of the kernel."""
    digest = hashlib.sha256(f"{FORMAT} {core.source_hash()}".encode())
    for part in parts:
        data = np.ascontiguousarray(part).tobytes() if isinstance(part, np.ndarray) else repr(part).encode()
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    return digest.hexdigest()
