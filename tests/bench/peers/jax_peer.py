"""JAX: RK4 as one scan, a design's ride written once and mapped over all by vmap, in double precision."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from tests.bench.peers.bogie import stepping, written
from tests.bench.peers.job import Answers, Job

jax.config.update("jax_enable_x64", True)
VERSION = f"jax {jax.__version__}"


def factor(square):  # type: ignore[no-untyped-def]
    q = jnp.sqrt(square)
    return jnp.where(q < 3.0, 1.0 - q / 3.0 + square / 27.0, 1.0 / jnp.maximum(q, 1.0))


def beyond(e, h):  # type: ignore[no-untyped-def]
    return e - jnp.clip(e, -h, h)


def as_it_is(function):  # type: ignore[no-untyped-def]
    return function


moved, ended = stepping(as_it_is)


def prepare(job: Job) -> Callable[[], Answers]:
    """The job, all designs at once; sums and filters travel with the scan, so that no series is kept."""
    accelerations = written(job.full, factor, beyond, as_it_is)
    h, clearance, wheelsets = job.dt, job.clearance, 2 if job.full else 1
    cascades = [[tuple(map(float, row)) for row in one] for one in job.named_sections.values()]

    def sums(kept, x, row, a_y):  # type: ignore[no-untyped-def]
        result, memory, squares = kept
        e = [x[2] - row[0], x[4] - row[4]][:wheelsets]
        result = [
            (s + one, q + one * one, t + jnp.where(abs(one) >= clearance, 1.0, 0.0))
            for (s, q, t), one in zip(result, e, strict=True)
        ]
        left, weighted = [], []
        for cascade, own, square in zip(cascades, memory, squares, strict=True):
            y, after = a_y, []
            for (b_0, b_1, b_2, _, a_1, a_2), (m_0, m_1) in zip(cascade, own, strict=True):
                out = b_0 * y + m_0
                after.append((b_1 * y - a_1 * out + m_1, b_2 * y - a_2 * out))
                y = out
            left.append(after)
            weighted.append(square + y * y)
        return result, left, weighted

    def ride(c, track):  # type: ignore[no-untyped-def]
        c = tuple(c)

        def step(carry, rows):  # type: ignore[no-untyped-def]
            x, kept = carry
            x = tuple(x)
            row_1, row_2, row_3 = rows
            a_1 = accelerations(x, c, row_1)
            kept = sums(kept, x, row_1, a_1[0])
            x_2 = moved(x, x, a_1, 0.5 * h)
            a_2 = accelerations(x_2, c, row_2)
            x_3 = moved(x, x_2, a_2, 0.5 * h)
            a_3 = accelerations(x_3, c, row_2)
            x_4 = moved(x, x_3, a_3, h)
            return (jnp.stack(ended(x, x_2, x_3, x_4, accelerations(x_4, c, row_3), h)), kept), None

        zero = jnp.zeros(())
        kept = [(zero,) * 3] * wheelsets, [[(zero, zero)] * len(one) for one in cascades], [zero] * len(cascades)
        (x, kept), _ = jax.lax.scan(step, (jnp.zeros(12), kept), (track[:-1:2], track[1::2], track[2::2]))
        last = track[-1]
        result, _, squares = sums(kept, x, last, accelerations(x, c, last)[0])
        return result, squares

    run = jax.jit(jax.vmap(ride, in_axes=(1, None)))
    c, track = jnp.asarray(job.c), jnp.asarray(job.track)

    def rides() -> Answers:
        result, squares = jax.block_until_ready(run(c, track))
        own = np.array(result)
        return job.of_sums(own[:, 0], own[:, 1], own[:, 2], np.array(squares) if job.full else None)

    return rides
