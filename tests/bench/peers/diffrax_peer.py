"""diffrax: classical Runge-Kutta as its own solver, constant steps from sample to sample, mapped over designs."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from tests.bench.peers.bogie import written
from tests.bench.peers.jax_peer import as_it_is, beyond, factor
from tests.bench.peers.job import Answers, Job

VERSION = f"diffrax {diffrax.__version__}"


class RungeKutta4(diffrax.AbstractERK):
    """The tableau of 1901; diffrax has none of its own, and its Tsit5 takes six rates a step."""

    tableau: ClassVar[diffrax.ButcherTableau] = diffrax.ButcherTableau(
        a_lower=(np.array([0.5]), np.array([0.0, 0.5]), np.array([0.0, 0.0, 1.0])),
        b_sol=np.array([1 / 6, 1 / 3, 1 / 3, 1 / 6]),
        b_error=np.zeros(4),
        c=np.array([0.5, 0.5, 1.0]),
    )

    @staticmethod
    def interpolation_cls(*, k, **more):  # type: ignore[no-untyped-def]
        return diffrax.LocalLinearInterpolation(**more)  # never asked: steps end at samples

    def order(self, terms: object) -> int:
        return 4


def prepare(job: Job) -> Callable[[], Answers]:
    """The job, all designs at once; what is kept of every sample is e and the frame's acceleration."""
    accelerations = written(job.full, factor, beyond, as_it_is)
    track, h, n = jnp.asarray(job.track), job.dt, job.samples

    def row(t):  # type: ignore[no-untyped-def]
        return track[jnp.round(t * (2.0 / h)).astype(int)]

    def rate(t, x, c):  # type: ignore[no-untyped-def]
        return jnp.concatenate([x[6:], jnp.stack(accelerations(tuple(x), tuple(c), row(t)))])

    def kept(t, x, c):  # type: ignore[no-untyped-def]
        here = row(t)
        return jnp.stack([x[2] - here[0], x[4] - here[4], accelerations(tuple(x), tuple(c), here)[0]])

    def ride(c):  # type: ignore[no-untyped-def]
        return diffrax.diffeqsolve(
            diffrax.ODETerm(rate), RungeKutta4(), 0.0, (n - 1) * h, h, jnp.zeros(12), args=c,
            saveat=diffrax.SaveAt(subs=diffrax.SubSaveAt(t0=True, steps=True, fn=kept)),
            stepsize_controller=diffrax.ConstantStepSize(), max_steps=n, adjoint=diffrax.ForwardMode(), throw=False,
        ).ys  # fmt: skip

    run, c = jax.jit(jax.vmap(ride, in_axes=1)), jnp.asarray(job.c)

    def rides() -> Answers:
        series = np.array(jax.block_until_ready(run(c)))[:, :n].transpose(2, 0, 1)
        return job.of_series(series[:2], series[2])

    return rides
