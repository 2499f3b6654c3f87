"""What share of a core's peak the standard job reaches."""

from __future__ import annotations

import csv
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

from railui.bench.standard_job import REPETITIONS, shortest_times
from railui.core import run_operation_chains, simd_level

TABLE: Final = Path(__file__).with_name("operations.csv")  # counted by a test of the kernel (operations.rs)

CHAIN_ROUNDS: Final = {"operations_per_second": (False, 1_000_000), "roots_per_second": (True, 100_000)}  # of milliseconds


def roofline(ns: dict[str, float], repetitions: int = REPETITIONS) -> dict[str, Any] | None:
    """The core's peak, and of jobs (`full`, `reduced`) that take so many `ns` per design-step their share of it.

    Peak: fused products per second on one thread, counted per lane, in chains that never leave the registers; square
    roots per second likewise, which most cores work on beside all else. `share`: the time that all operations of a
    design-step would take at the first rate, each counted as one, over the time that it takes. `roots_share`: the time
    that its square roots alone would take at the second rate. Loads, stores, signs and whatever else a step needs do
    not count, nor does sliding, which is rare. Sums and choices that a core makes beside fused products could take it
    above one. None without vector instructions, where another form of the rate runs.

    >>> peak({}) is None or sorted(peak({}, 1))
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
    with TABLE.open(newline="", encoding="utf-8") as file:
        return {row.pop("job"): {name: int(n) for name, n in row.items()} for row in csv.DictReader(file)}


def measure_peaks(repetitions: int = REPETITIONS) -> dict[str, float]:
    """Fused products and square roots per second, counted per lane, on one thread."""
    seconds = shortest_times([partial(run_operation_chains, *links) for links in CHAIN_ROUNDS.values()], repetitions)
    return {name: run_operation_chains(*CHAIN_ROUNDS[name]) / each for name, each in zip(CHAIN_ROUNDS, seconds, strict=True)}


def share_of_peak(
    operations: dict[str, int], ns: float, operations_per_second: float, roots_per_second: float
) -> dict[str, Any]:
    """Operations of a design-step, and the shares of both peaks where it takes so many nanoseconds.

    >>> share({"fused": 6, "sums": 3, "roots": 1}, 2.0, 10e9, 1e9)
    {'operations': {'fused': 6, 'sums': 3, 'roots': 1}, 'share': 0.5, 'roots_share': 0.5}
    """
    per_second = 1e9 / ns
    return {
        "operations": operations,
        "share": sum(operations.values()) * per_second / operations_per_second,
        "roots_share": operations["roots"] * per_second / roots_per_second,
    }
