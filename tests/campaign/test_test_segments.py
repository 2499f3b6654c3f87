"""Segments that select effects and segments that are held back for the test."""

from __future__ import annotations

import numpy as np
import pytest

from railui.campaign.dataset import hold_back
from railui.campaign.segment import Segment
from railui.campaign.settings.estimation import ValidationSettings

RATE = 100.0


def segment(seconds: float, number: int = 0, run: int = 0, kind: str = "bogie", rate: float = RATE) -> Segment:
    t = np.arange(round(seconds * rate)) / rate
    columns = {"t": t, "s": 30.0 * t, "v": np.full(len(t), 30.0), "yw": np.sin(t), "ay1": np.cos(t)}
    return Segment("run.csv", "validate", number, columns, 1.0 / rate, kind, run_index=run)


def seconds_of(segments: list[Segment]) -> list[float]:
    return [round(s.samples * s.dt, 6) for s in segments]


def split(*segments: Segment) -> tuple[list[float], list[float]]:
    parts = hold_back(segments, ValidationSettings(), rig_rate=400.0)
    return seconds_of(parts.selection), seconds_of(parts.test)


def test_the_last_third_of_a_run_is_held_back():
    assert split(segment(45.0)) == ([30.0], [15.0])


def test_a_short_run_is_not_cut():
    assert split(segment(29.0)) == ([29.0], [])


def test_every_run_is_cut_by_itself():
    assert split(segment(60.0, run=0), segment(20.0, run=1)) == ([40.0, 20.0], [20.0])


def test_of_a_run_in_segments_the_last_ones_are_held_back():
    assert split(segment(30.0, 0), segment(15.0, 1), segment(15.0, 2)) == ([30.0, 15.0], [15.0])


def test_a_run_is_used_once_in_whole():
    parts = hold_back([segment(47.3)], ValidationSettings(), 400.0)
    times = np.concatenate([s.columns["t"] for s in (*parts.selection, *parts.test)])
    np.testing.assert_array_equal(times, segment(47.3).columns["t"])


def test_of_a_rig_a_part_needs_samples_not_seconds():
    assert split(segment(1.0, kind="rig", rate=20_000.0)) == ([pytest.approx(0.66665)], [pytest.approx(0.33335)])


def test_a_rig_sampled_slowly_is_not_cut_into_a_few_samples():
    assert split(segment(1000.0, kind="rig", rate=0.25)) == ([1000.0], [])


def test_a_part_has_the_track_of_the_whole():
    whole = segment(45.0)
    part = whole.part(3000, 4500)
    table = whole.table(1.25, 2)
    np.testing.assert_array_equal(part.table(1.25, 2), table[2 * 2 * 3000 : 2 * 2 * 4499 + 1])
    assert part.segment_key == whole.segment_key


def test_the_first_part_of_a_part_has_its_track():
    part = segment(45.0).part(3000, 4500)
    np.testing.assert_array_equal(part.truncated(500).table(1.25, 2), part.table(1.25, 2)[: 2 * 2 * 499 + 1])
