"""Connection of a command to the workers of a dask scheduler."""

from __future__ import annotations

from typing import TYPE_CHECKING

from railui.cli.invocation import InfoLines, Invocation, usage_error
from railui.io.extras import install_extra

if TYPE_CHECKING:
    from railui.execution.dask_cluster import DaskRunner


def connect(scheduler: str, call: Invocation, remedy: str | None = None) -> DaskRunner:
    """Connect to a scheduler; UsageError without the packages, ClusterError where none answers.

    remedy: what to do where the scheduler is lost; by default to repeat the command, which resumes.
    """
    try:
        from railui.execution.dask_cluster import DaskRunner
        from railui.execution.tasks import RESUMES
    except ModuleNotFoundError as error:
        raise usage_error(f"--scheduler needs {error.name}: {install_extra('cluster')}") from None
    return DaskRunner(scheduler, InfoLines(call), remedy or RESUMES)
