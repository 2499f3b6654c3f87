"""Bundles of tasks that are sent to a worker of a cluster together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from railui.execution.tasks import Task

BUNDLE_SECONDS: Final = 1.0  # long compared with the scheduler's overhead, short compared with the loss of a worker


@dataclass(frozen=True, eq=False)
class TaskBundle:
    """Tasks that are sent together.

    `is_isolated` for one vehicle that runs while the cluster runs nothing else, `is_repeated` after an evaluation that
    failed by no fault of the designs.
    """

    tasks: list[Task]
    is_isolated: bool = False
    is_repeated: bool = False

    @property
    def samples(self) -> int:
        """Number of track samples over all vehicles."""
        return sum(task.samples for task in self.tasks)

    @property
    def vehicles(self) -> int:
        """Number of vehicles."""
        return sum(map(len, self.tasks))

    def split(self) -> list[TaskBundle]:
        """Return one bundle per vehicle."""
        return [TaskBundle([task.select(slice(i, i + 1))]) for task in self.tasks for i in range(len(task))]


def bundle_tasks(tasks: Sequence[Task], pace: float, workers: int) -> list[TaskBundle]:
    """Combine tasks to bundles of `BUNDLE_SECONDS`, smaller if workers would be idle.

    `pace` is the duration per vehicle and track sample [s].
    """
    max_samples = min(BUNDLE_SECONDS / pace, sum(task.samples for task in tasks) / (2 * workers))
    bundles: list[list[Task]] = []
    available = 0.0
    for task in tasks:
        if not bundles or task.samples > available:
            bundles.append([])
            available = max_samples
        bundles[-1].append(task)
        available -= task.samples
    return [TaskBundle(bundle) for bundle in bundles]
