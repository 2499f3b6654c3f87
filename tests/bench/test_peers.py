"""Equations of the peers against the kernel."""

import numpy as np
import pytest

from tests.bench.peers.bogie import stepping, written
from tests.bench.peers.job import Job, difference, jobs


@pytest.mark.parametrize("job", jobs(), ids=lambda job: job.name)
def test_the_equations_for_peers_agree_with_the_kernel(job: Job) -> None:
    job = job.part(designs=20, samples=1500)
    e, acceleration = ridden(job)
    assert np.max(np.abs(e)) > (job.clearance if job.full else 0.004)  # the full job touches the flange
    assert difference(job.of_series(e, acceleration), job.kernel()()) < 1e-11


def ridden(job: Job) -> tuple[np.ndarray, np.ndarray]:
    """e [wheelset, design, sample] and the frame's acceleration [design, sample], by RK4 in numpy."""

    def factor(square: np.ndarray) -> np.ndarray:
        q = np.sqrt(square)
        return np.where(q < 3, 1 - q / 3 + square / 27, 1 / np.maximum(q, 1))

    accelerations = written(job.full, factor, lambda e, h: e - np.clip(e, -h, h), lambda f: f)
    moved, ended = stepping(lambda f: f)
    c, rows, h, x, kept = job.c, job.track, job.dt, tuple(np.zeros((12, len(job.rows)))), []
    for k in range(job.samples):
        near, middle, far = rows[2 * k], rows[min(2 * k + 1, len(rows) - 1)], rows[min(2 * k + 2, len(rows) - 1)]
        a_1 = accelerations(x, c, near)
        kept.append((x[2] - near[0], x[4] - near[4], a_1[0]))
        x_2 = moved(x, x, a_1, h / 2)
        a_2 = accelerations(x_2, c, middle)
        x_3 = moved(x, x_2, a_2, h / 2)
        a_3 = accelerations(x_3, c, middle)
        x_4 = moved(x, x_3, a_3, h)
        x = ended(x, x_2, x_3, x_4, accelerations(x_4, c, far), h)
    series = np.array(kept).transpose(1, 2, 0)
    return series[:2], series[2]
