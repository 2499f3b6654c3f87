"""Roofline of the standard job: its share of the peak performance of a core."""

from __future__ import annotations

import csv
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

from railui.bench.standard_job import REPETITIONS, shortest_times
from railui.core import run_operation_chains, simd_level

OPERATIONS_FILE: Final = Path(__file__).with_name("operations.csv")  # counted by a test of the kernel (operations.rs)

# square roots or not, and rounds of a chain, which take milliseconds
CHAIN_ROUNDS: Final = {"operations_per_second": (False, 1_000_000), "roots_per_second": (True, 100_000)}


def roofline(ns: dict[str, float], repetitions: int = REPETITIONS) -> dict[str, Any] | None:
    """Measure the peak performance of a core and the share of it that jobs (`full`, `reduced`) reach.

    Peak: fused products per second on one thread, counted per lane, in chains that stay in registers; square roots per
    second likewise, which most cores compute in parallel with other operations. Loads, stores, signs and other
    instructions of a step do not count, nor does sliding, which is rare. Sums and choices that a core executes in
    parallel with fused products could raise the share above one.

    Parameters
    ----------
    ns : dict
        Time per design-step [ns] by job.
    repetitions : int
        Repetitions of the measurement.

    Returns
    -------
    dict or None
        Peaks, and by job `share`: the time of all operations of a design-step at the first rate over its time, and
        `roots_share`: likewise of its square roots at the second rate. None without vector instructions, where another
        form of the equations runs.

    Examples
    --------
    >>> roofline({}) is None or sorted(roofline({}, 1))
    ['operations_per_second', 'roots_per_second']
    """
    if simd_level() == "portable":
        return None
    rates = measure_peaks(repetitions)
    return rates | {job: share_of_peak(operations()[job], each, **rates) for job, each in ns.items()}


@cache
def operations() -> dict[str, dict[str, int]]:
    """Return the operations of a design-step of each job of the plain bogie, where no wheel slides.

    Fused products, products, sums, choices (minima, maxima, comparisons), square roots and quotients; signs and
    magnitudes do not count.

    >>> operations()["full"]["roots"]  # one per slope, wheelset and wheel
    16
    """
    with OPERATIONS_FILE.open(newline="", encoding="utf-8") as file:
        return {row.pop("job"): {name: int(n) for name, n in row.items()} for row in csv.DictReader(file)}


def measure_peaks(repetitions: int = REPETITIONS) -> dict[str, float]:
    """Measure fused products and square roots per second, counted per lane, on one thread."""
    seconds = shortest_times([partial(run_operation_chains, *chain) for chain in CHAIN_ROUNDS.values()], repetitions)
    counts = [run_operation_chains(*chain) for chain in CHAIN_ROUNDS.values()]
    return {name: count / each for name, count, each in zip(CHAIN_ROUNDS, counts, seconds, strict=True)}


def share_of_peak(
    operations: dict[str, int], ns: float, operations_per_second: float, roots_per_second: float
) -> dict[str, Any]:
    """Return the operations of a design-step and its shares of both peaks, from its time `ns` [ns].

    >>> share_of_peak({"fused": 6, "sums": 3, "roots": 1}, 2.0, 10e9, 1e9)
    {'operations': {'fused': 6, 'sums': 3, 'roots': 1}, 'share': 0.5, 'roots_share': 0.5}
    """
    per_second = 1e9 / ns
    return {
        "operations": operations,
        "share": sum(operations.values()) * per_second / operations_per_second,
        "roots_share": operations["roots"] * per_second / roots_per_second,
    }
