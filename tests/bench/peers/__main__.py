"""Both standard jobs in railui and in its peers, on one core, in turns: make bench-peers.

python -m tests.bench.peers [--rounds 5] [--write docs/peers.md]: processor time, the median of the rounds; slow peers
ride a part of the designs and of the track. Every answer is held to the kernel's for the same part.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from statistics import median

CORE = max(os.sched_getaffinity(0))
os.sched_setaffinity(0, {CORE})  # before any library counts the cores

import numpy as np  # noqa: E402

from railui.bench.benchmark_log import processor_name, source_commit  # noqa: E402
from railui.core import simd_level  # noqa: E402
from tests.bench.page import write_after  # noqa: E402
from tests.bench.peers import diffrax_peer, exudyn_peer, jax_peer, numba_peer, scipy_peer  # noqa: E402
from tests.bench.peers.job import Answers, Job, difference, jobs  # noqa: E402

WITHIN = 1e-4
Run = Callable[[], Answers]


@dataclass(frozen=True)
class Peer:
    """A program, and how much of a job it simulates."""

    name: str
    version: str
    prepare: Callable[[Job], Run]
    designs: int = 64
    samples: int = 20_000


PEERS = (
    Peer("railui", f"SIMD {simd_level()}", Job.kernel),
    Peer("numba, 16 designs side by side", numba_peer.VERSION, lambda job: numba_peer.prepare(job, 16)),
    Peer("numba, design by design", numba_peer.VERSION, lambda job: numba_peer.prepare(job, 1), 16),
    Peer("JAX, scan and vmap", jax_peer.VERSION, jax_peer.prepare),
    Peer("diffrax, RK4 and vmap", diffrax_peer.VERSION, diffrax_peer.prepare, 64, 4_000),
    Peer("Exudyn RK44, force by numba", exudyn_peer.VERSION, lambda job: exudyn_peer.prepare(job, True), 1, 4_000),
    Peer("Exudyn RK44, force in Python", exudyn_peer.VERSION, lambda job: exudyn_peer.prepare(job, False), 1, 4_000),
    Peer("scipy solve_ivp, rate by numba", scipy_peer.VERSION, lambda job: scipy_peer.prepare(job, True), 1, 4_000),
    Peer("scipy solve_ivp, rate in Python", scipy_peer.VERSION, lambda job: scipy_peer.prepare(job, False), 1, 4_000),
)


@dataclass(frozen=True)
class Row:
    """Time of a program for a job, and its difference from the kernel."""

    peer: Peer
    ns: float  # per design-step
    difference: float


def measure(job: Job, rounds: int) -> list[Row]:
    """All peers in turns, after one run of each to compile; AssertionError where an answer is another one."""
    parts = [job.part(peer.designs, peer.samples) for peer in PEERS]
    runs = [peer.prepare(part) for peer, part in zip(PEERS, parts, strict=True)]
    apart = [difference(run(), part.kernel()()) for run, part in zip(runs, parts, strict=True)]
    for peer, one in zip(PEERS, apart, strict=True):
        assert one < WITHIN, f"{peer.name}, {job.name}: answers differ by {one:.1e}"
    times: list[list[float]] = [[] for _ in runs]
    for _ in range(rounds):
        for run, each in zip(runs, times, strict=True):
            start = time.process_time()
            run()
            each.append(time.process_time() - start)
    ns = (1e9 * median(each) / part.design_steps for each, part in zip(times, parts, strict=True))
    return [Row(*each) for each in zip(PEERS, ns, apart, strict=True)]


def table(job: Job, rows: Sequence[Row]) -> str:
    """The rows of a job as Markdown."""
    lines = [
        f"### {job.name.capitalize()} job\n",
        "| | ns per design-step | designs/s | times railui | differs from railui by | simulated | version |",
        "| --- | ---: | ---: | ---: | ---: | --- | --- |",
    ]
    steps = job.samples - 1
    for row in rows:
        extent = f"{row.peer.designs} x {row.peer.samples / 10_000:.1f} km"
        apart = "" if row.peer is PEERS[0] else f"{row.difference:.0e}"
        per_second = f"{1e9 / (row.ns * steps):,.3g}" if row.ns * steps > 1e6 else f"{1e9 / (row.ns * steps):,.0f}"
        speed = f"{row.ns:,.0f}" if row.ns >= 100 else f"{row.ns:.1f}"
        ratio = f"{row.ns / rows[0].ns:.3g}" if row.ns < 1000 * rows[0].ns else f"{row.ns / rows[0].ns:,.0f}"
        lines.append(
            f"| {row.peer.name} | {speed} | {per_second} | {ratio} | {apart} | {extent} | {row.peer.version} |"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--write", type=Path, help="a page whose results are written anew")
    args = parser.parse_args()
    where = f"{datetime.now(UTC):%Y-%m-%d}, railui at {source_commit()}, one core of {processor_name()}"
    head = f"{where}, numpy {np.__version__}; the median of {args.rounds} rounds in turns."
    text = "\n\n".join([head, *(table(job, measure(job, args.rounds)) for job in jobs())]) + "\n"
    print(text)
    if args.write:
        write_after(args.write, text)


if __name__ == "__main__":
    main()
