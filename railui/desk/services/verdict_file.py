"""File of a verdict: a finished loop with everything that its panes show and its report needs."""

from __future__ import annotations

import copyreg
import io
import pickle
from collections.abc import Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, Final

import railui
from railui.campaign.segment import Segment
from railui.core.batch import ZeroPhaseFilter
from railui.desk.presenters.loop_history import Ranking
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.progress import SILENT, Progress

if TYPE_CHECKING:
    from railui.identification.result import LoopResult
    from railui.identification.structure.refit import Refit

SILENT_PROGRESS: Final = "silent progress"  # in place of the receiver of the loop's messages, which has ended
NUMPY_NAMES: Final = {"dtype", "ndarray", "_reconstruct", "scalar", "_frombuffer"}
BUILTIN_NAMES: Final = {"slice", "set", "frozenset", "complex", "range", "bytearray"}
RECORD_TYPES: Final = (tuple, Enum, ZeroPhaseFilter)  # besides dataclasses
PATH_NAMES: Final = {"Path", "PosixPath", "PurePosixPath"}


class VerdictUnreadableError(ValueError):
    """The file of a verdict is damaged, or of another version."""


@dataclass(frozen=True, eq=False)
class StoredVerdict:
    """Finished loop, the lines of its log, and errors, parameters and rankings as they were shown."""

    finished: FinishedLoop
    lines: Sequence[str]
    errors: dict[str, Any]
    totals: dict[str, float]
    iteration: Any
    findings: Sequence[Any]
    rankings: Sequence[Ranking] = field(default_factory=list)


class _Writer(pickle.Pickler):
    """Writer that leaves out the input tables of segments, which are computed again where they are needed."""

    def reducer_override(self, obj: Any) -> Any:
        if type(obj) is not Segment:
            return NotImplemented
        return copyreg.__newobj__, (Segment,), vars(obj) | {"tables": {}}  # type: ignore[attr-defined]

    def persistent_id(self, obj: Any) -> str | None:
        return SILENT_PROGRESS if isinstance(obj, Progress) else None


class _Reader(pickle.Unpickler):
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
        raise pickle.UnpicklingError(f"{module}.{name} is not part of a verdict")


def verdict_bytes(verdict: StoredVerdict) -> bytes:
    """Return a verdict as bytes."""
    finished = replace(verdict.finished, result=_without_blocks(verdict.finished.result))
    buffer = io.BytesIO()
    writer = _Writer(buffer, protocol=pickle.HIGHEST_PROTOCOL)
    writer.dump((railui.__version__, replace(verdict, finished=finished)))
    return buffer.getvalue()


def _without_blocks(result: LoopResult) -> LoopResult:
    """Return a result whose refits have one block: their blocks serve the comparison of rivals, which is in the report.

    The misfit of a refit and its covariance stay the same; the models before and after the effects keep their blocks.
    """
    steps = tuple(
        replace(step, refits=tuple(_without_block(refit, result) for refit in step.refits)) for step in result.steps
    )
    return replace(result, steps=steps)


def _without_block(refit: Refit, result: LoopResult) -> Refit:
    if refit.fit is result.after or refit.fit is result.before:
        return refit
    normal = refit.fit.normal
    return replace(refit, fit=replace(refit.fit, normal=replace(normal, gram=normal.total[None, None])))


def read_verdict(data: bytes) -> StoredVerdict:
    """Return the verdict of bytes; raise VerdictUnreadableError if they are not of this version."""
    try:
        version, verdict = _Reader(io.BytesIO(data)).load()
    except Exception as error:  # damaged data may raise anything
        raise VerdictUnreadableError(f"the stored verdict cannot be read: {error}") from error
    if version != railui.__version__ or not isinstance(verdict, StoredVerdict):
        raise VerdictUnreadableError(f"the stored verdict is of version {version}, this is {railui.__version__}")
    return verdict
