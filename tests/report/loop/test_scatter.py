"""Simulated against measured values: pairs of every channel, slopes, and the effect's gain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from railui.identification.result import LoopResult
from railui.report.loop.figures import most_informative_window
from railui.report.loop.scatter import ChannelPairs, channel_pairs, scatter_rows
from tests.report.loop.names import CHANNELS


def test_pairs_are_those_of_all_validation_runs_and_closer_after_the_effect(loop_result: LoopResult) -> None:
    (pairs,) = channel_pairs(loop_result, ["e1"])
    before, after = pairs.simulated["before"], pairs.simulated["after"]
    assert pairs.measured.shape == before.shape == after.shape
    assert np.std(pairs.measured - after) < 0.5 * np.std(pairs.measured - before)
    assert abs(pairs.slope("after") - 1.0) < 0.01


def test_the_slope_is_the_gain_that_the_model_lacks() -> None:
    x = np.sin(np.arange(50.0))
    pairs = ChannelPairs("e1", 0.8 * x, {"before": x, "after": np.zeros(50)})
    assert abs(pairs.slope("before") - 0.8) < 1e-12 and np.isnan(pairs.slope("after"))


def test_a_model_that_diverged_is_left_out(loop_result: LoopResult) -> None:
    diverged = replace(
        loop_result.validations["before"],
        series=tuple(np.full_like(x, np.nan) for x in loop_result.validations["before"].series),
    )
    result = replace(loop_result, validations={**loop_result.validations, "before": diverged})
    rows = scatter_rows(result, most_informative_window(loop_result), CHANNELS[:2])
    assert [row["name"] for row in rows] == list(CHANNELS[:2])
    assert all("calibrated + effect" in row["slopes"] and "," not in row["slopes"] for row in rows)
