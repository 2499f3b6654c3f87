"""What share of a core's peak the standard job reaches."""

from __future__ import annotations

from functools import partial
from typing import Any, Final

from railui.bench.standard_job import REPETITIONS, Rolling, bogie, quickest, road, rolling, rolling_reduced, spread
from railui.core import chains, simd

ROUNDS: Final = {"operations_per_second": (False, 1_000_000), "roots_per_second": (True, 100_000)}  # of milliseconds


def peak(ns: dict[str, float], repetitions: int = REPETITIONS) -> dict[str, Any] | None:
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
    if simd() == "portable":
        return None
    rates = peaks(repetitions)
    jobs: dict[str, Rolling] = {
        "full": rolling(bogie(), spread(bogie(), 1), road()),
        "reduced": rolling_reduced(spread(bogie(reduced=True), 1)),
    }
    return rates | {name: share_of_peak(jobs[name].arithmetic() or {}, each, **rates) for name, each in ns.items()}


def peaks(repetitions: int = REPETITIONS) -> dict[str, float]:
    """Fused products and square roots per second, counted per lane, on one thread."""
    seconds = quickest([partial(chains, *links) for links in ROUNDS.values()], repetitions)
    return {name: chains(*ROUNDS[name]) / each for name, each in zip(ROUNDS, seconds, strict=True)}


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
