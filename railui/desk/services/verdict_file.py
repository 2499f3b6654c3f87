"""File of a verdict: a finished loop with everything that its panes show and its report needs."""

from __future__ import annotations

import io
import pickle
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import railui
from railui.desk.presenters.loop_history import Ranking
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.desk.services.record_stream import RecordReader, RecordWriter

if TYPE_CHECKING:
    from railui.identification.result import LoopResult
    from railui.identification.structure.refit import Refit


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


def verdict_bytes(verdict: StoredVerdict) -> bytes:
    """Return a verdict as bytes."""
    finished = replace(verdict.finished, result=_without_blocks(verdict.finished.result))
    buffer = io.BytesIO()
    writer = RecordWriter(buffer, protocol=pickle.HIGHEST_PROTOCOL)
    writer.dump((railui.__version__, replace(verdict, finished=finished)))
    return buffer.getvalue()


def _without_blocks(result: LoopResult) -> LoopResult:
    """Return a result whose refits have one block: their blocks serve the comparison of rivals, which is in the report.

    The misfit of a refit and its covariance stay the same; the models before and after the effects keep their blocks.
    """

    def without(refits: Sequence[Refit]) -> tuple[Refit, ...]:
        return tuple(_without_block(refit, result) for refit in refits)

    steps = tuple(
        replace(step, refits=without(step.refits), alternatives=without(step.alternatives)) for step in result.steps
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
        version, verdict = RecordReader(io.BytesIO(data)).load()
    except Exception as error:  # damaged data may raise anything
        raise VerdictUnreadableError(f"the stored verdict cannot be read: {error}") from error
    if version != railui.__version__ or not isinstance(verdict, StoredVerdict):
        raise VerdictUnreadableError(f"the stored verdict is of version {version}, this is {railui.__version__}")
    return verdict
