"""Machines of a cluster for the tests of this folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.execution.cluster import LocalCluster


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[LocalCluster]:
    """Scheduler on this machine, to which a test adds workers."""
    from tests.execution.cluster import LocalCluster

    directory = tmp_path / "machines"
    directory.mkdir()
    machines = LocalCluster(directory)
    yield machines
    machines.stop()
