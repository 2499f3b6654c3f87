"""Connection of a command to the workers of a dask scheduler."""

from __future__ import annotations

from typing import TYPE_CHECKING

from railui.cli.invocation import InfoLines, Invocation, usage_error
from railui.io.extras import install_extra

if TYPE_CHECKING:
    from railui.execution.dask_cluster import DaskRunner


def connect(scheduler: str, call: Invocation) -> DaskRunner:
    """Connect to a scheduler; UsageError without the packages, ClusterError where none answers."""
    try:
        from railui.execution.dask_cluster import DaskRunner
    except ModuleNotFoundError as error:
        raise usage_error(f"--scheduler needs {error.name}: {install_extra('cluster')}") from None
    return DaskRunner(scheduler, InfoLines(call))
