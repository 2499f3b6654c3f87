"""Records of the desk in files and between processes: dataclasses, arrays and paths; reading them runs no code."""

from __future__ import annotations

import copyreg
import pickle
from dataclasses import is_dataclass
from enum import Enum
from typing import Any, Final

from railui.campaign.segment import Segment
from railui.core.batch import ZeroPhaseFilter
from railui.progress import SILENT, Progress

SILENT_PROGRESS: Final = "silent progress"  # in place of the receiver of messages, which ends with its process
NUMPY_NAMES: Final = {"dtype", "ndarray", "_reconstruct", "scalar", "_frombuffer"}
BUILTIN_NAMES: Final = {"slice", "set", "frozenset", "complex", "range", "bytearray"}
RECORD_TYPES: Final = (tuple, Enum, ZeroPhaseFilter)  # besides dataclasses
PATH_NAMES: Final = {"Path", "PosixPath", "PurePosixPath"}


class RecordWriter(pickle.Pickler):
    """Writer that leaves out the input tables of segments, which are computed again where they are needed.

    Members of enumerations are written by their value, whatever the version of Python.
    """

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, Enum):  # 3.11.0 to 3.11.3 would write a call of getattr
            return type(obj), (obj.value,)
        if type(obj) is not Segment:
            return NotImplemented
        return copyreg.__newobj__, (Segment,), vars(obj) | {"tables": {}}  # type: ignore[attr-defined]

    def persistent_id(self, obj: Any) -> str | None:
        return SILENT_PROGRESS if isinstance(obj, Progress) else None


class RecordReader(pickle.Unpickler):
    """Reader that creates only records of railui, arrays and paths, and calls no other function."""

    def persistent_load(self, pid: Any) -> Any:
        if pid != SILENT_PROGRESS:
            raise pickle.UnpicklingError(f"unknown object {pid!r}")
        return SILENT

    def find_class(self, module: str, name: str) -> Any:
        root = module.split(".")[0]
        names = {"numpy": NUMPY_NAMES, "builtins": BUILTIN_NAMES, "pathlib": PATH_NAMES}.get(root)
        if names is not None and name in names:
            return super().find_class(module, name)
        if root == "railui":
            found = super().find_class(module, name)
            if isinstance(found, type) and (is_dataclass(found) or issubclass(found, RECORD_TYPES)):
                return found
        raise pickle.UnpicklingError(f"{module}.{name} is not a record of railui")
