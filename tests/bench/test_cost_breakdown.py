"""Cost breakdown and roofline: properties that do not depend on the clock."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest

from railui.bench import cost_breakdown
from railui.bench.roofline import CHAIN_ROUNDS, operations, roofline, share_of_peak
from railui.bench.standard_job import bogie_model, ride_job, spread_designs, standard_excitation
from railui.bench.step_error import effect_cases
from railui.core import run_operation_chains, simd_level

WAY = standard_excitation(length=50.0)
SLOPES, WHEELSETS, WHEELS = 4, 2, 2


def test_square_roots_are_counted_per_slope_wheel_and_wheelset() -> None:
    jobs = operations()
    assert jobs["full"]["roots"] == SLOPES * WHEELSETS * WHEELS
    assert jobs["reduced"]["roots"] == SLOPES * WHEELSETS
    assert sum(jobs["reduced"].values()) < sum(jobs["without comfort"].values())


def test_comfort_adds_five_operations_per_section_and_sample() -> None:
    whole = ride_job(bogie_model(), spread_designs(bogie_model(), 1), WAY)
    sections = [each.shape[1] for each in whole.sections.values()]
    points = len(whole.channels) - whole.wheelsets
    added = sum(operations()["full"].values()) - sum(operations()["without comfort"].values())
    # a section: three fused products, a product, a sum; a cascade: the sum of squares; the acceleration is one rate
    assert added == points * (5 * sum(sections) + len(sections) + 1)


def test_nothing_slides_where_operations_are_counted() -> None:
    assert all(counts["quotients"] == 0 for counts in operations().values())


def test_links_of_chains_are_counted_per_lane() -> None:
    each = {rounds: run_operation_chains(roots=False, rounds=rounds) for rounds in (10, 30)}
    assert each[30] == 3 * each[10] == 3 * run_operation_chains(roots=True, rounds=10)
    assert each[10] % (10 * {"portable": 4, "v3": 4, "v4": 8}[simd_level()]) == 0


def test_a_share_is_the_time_at_the_peak_over_the_measured_time() -> None:
    counts = dict.fromkeys(operations()["full"], 10)
    result = share_of_peak(counts, 20.0, 6e9, 1e9)
    assert result == {"operations": counts, "share": pytest.approx(0.5), "roots_share": pytest.approx(0.5)}
    assert share_of_peak(counts, 40.0, 6e9, 1e9)["share"] == pytest.approx(0.25)


@pytest.mark.skipif(simd_level() == "portable", reason="the plain form is not compiled for it")
def test_no_job_exceeds_the_peak() -> None:
    result: Any = roofline({"full": 1e3, "reduced": 1e3}, 1)
    assert all(result[rate] > 0 for rate in CHAIN_ROUNDS)
    for job in ("full", "reduced"):
        assert 0 < result[job]["share"] < 1 and 0 < result[job]["roots_share"] < 1


def test_scaling_has_every_number_of_threads() -> None:
    threads = (os.cpu_count() or 1) + 1
    result = cost_breakdown.thread_scaling(threads, 16, 50.0, 1)
    assert [row["threads"] for row in result] == list(range(1, threads + 1))
    assert result[0]["times_one"] == 1.0
    for row in result:
        assert row["times_one"] == pytest.approx(row["designs_per_second"] / result[0]["designs_per_second"])


def test_every_kind_of_effect_is_timed_against_none() -> None:
    result = cost_breakdown.effect_costs(1, 20.0, 1)
    assert [row["effects"] for row in result] == [kinds for vehicle, kinds, _ in effect_cases() if vehicle == "bogie"]
    assert result[0]["effects"] == "none" and result[0]["over_none"] == 0.0
    assert np.allclose([r["ns_per_design_step"] - r["over_none"] for r in result], result[0]["ns_per_design_step"])


def test_the_cost_of_a_call_is_the_intercept_without_designs(monkeypatch: pytest.MonkeyPatch) -> None:
    a_call, a_design = 50e-6, 9e-6  # s
    times = [cost_breakdown.CALLS * (a_call + n * a_design) for n in (1, 16)]
    monkeypatch.setattr(cost_breakdown, "shortest_times", lambda runs, repetitions: times)
    assert cost_breakdown.call_costs() == pytest.approx({"crossing_us_per_call": 50.0, "setup_us_per_design": 9.0})
