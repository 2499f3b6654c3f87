"""Self-test of the installation, and speed of the kernel."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def self_test(reference: str | Path | None = None, *, jobs: int | None = None) -> dict[str, Any]:
    """Run the installation self-test against reference values, as `railui doctor`.

    Parameters
    ----------
    reference : str or Path, optional
        Directory with data of third parties (en15302, profiles); checks that need them are skipped without it.
    jobs : int, optional
        Threads; by default all.

    Returns
    -------
    dict
        ok, checks (name, expected, got, tolerance, ok, source), skipped, machine, seconds.
    """
    from railui.doctor import doctor

    return doctor(None if reference is None else Path(reference), jobs)


def benchmark(repetitions: int = 5, *, jobs: int | None = None) -> dict[str, Any]:
    """Time the standard job of the kernel on this machine, as `railui bench`.

    Parameters
    ----------
    repetitions : int
        Number of repetitions; the fastest counts.
    jobs : int, optional
        Threads; by default all.

    Returns
    -------
    dict
        full, reduced, coach: ns_per_design_step, designs_per_second; peak, scaling, effects and further costs.
    """
    from railui.bench.cost_breakdown import costs
    from railui.bench.roofline import roofline
    from railui.bench.standard_job import run_standard_job

    result = run_standard_job(jobs, repetitions)
    result["peak"] = roofline({job: result[job]["ns_per_design_step"] for job in ("full", "reduced")}, repetitions)
    return result | costs(jobs, repetitions)
