"""The gate before an adjustment: each fault of the data is told with its channel, and sound data pass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from railui.campaign.data_checks import _gaps, _stuck, check_data
from railui.campaign.dataset import Dataset
from railui.campaign.finding import Finding
from tests.blind.made import made

Change = Callable[[np.ndarray, np.ndarray], np.ndarray]


def spoiled(channel: str, change: Change) -> list[Finding]:
    """What the gate says once a channel has been changed in every run."""
    m: Dataset = made().measurement
    stretches = tuple(
        replace(s, columns={**s.columns, channel: change(s.columns[channel], s.columns["t"])}, tables={})
        for s in m.stretches
    )
    return [f for f in check_data(replace(m, stretches=stretches)) if f.check != "ceiling"]


def test_sound_data_pass():
    assert [f for f in check_data(made().measurement) if f.check != "ceiling"] == []


@pytest.mark.parametrize("channel", ["ay1", "ay2", "d1", "e2"])
def test_a_sensor_mounted_the_wrong_way_round_is_named(channel: str):
    found = spoiled(channel, lambda x, t: -x)
    assert {f.channel for f in found if f.check == "sign"} == {channel}
    assert found[0].serious


def test_a_late_channel_is_told_with_its_delay():
    # 12 ms on e1: the acceleration that it owes comes late, so ay1 seems early by as much, within what noise blurs
    found = [f for f in spoiled("e1", lambda x, t: np.interp(t - 0.012, t, x)) if f.check == "clock"]
    assert {f.channel for f in found} == {"e1"}
    assert all(-0.014 < f.value < -0.005 for f in found)


def test_a_gain_is_told_with_its_size():
    found = [f for f in spoiled("d1", lambda x, t: 1.4 * x) if f.check == "gain"]
    assert {f.channel for f in found} == {"d1"}
    assert all(f.value == pytest.approx(1.4, rel=0.15) for f in found)


def test_a_clipped_channel_is_told_with_its_share():
    found = [f for f in spoiled("d2", lambda x, t: np.clip(x, -x.std(), x.std())) if f.check == "clipping"]
    # a Gaussian channel is beyond one standard deviation for 32 % of the time
    assert {f.channel for f in found} == {"d2"}
    assert all(0.15 < f.value < 0.45 for f in found)


def test_a_hunting_stretch_is_found_with_its_frequency():
    def hunt(x: np.ndarray, t: np.ndarray) -> np.ndarray:
        return x + np.where((t > 8.0) & (t < 12.0), 20.0 * x.std() * np.sin(2 * np.pi * 3.0 * t), 0.0)

    found = [f for f in spoiled("ay1", hunt) if f.check == "hunting"]
    assert found
    assert all(f.value == pytest.approx(3.0, abs=0.3) for f in found)
    speeds = {s.file: s.mean_speed for s in made().measurement.stretches}
    for f in found:
        wave = float(f.text.rpartition("wavelength ")[2].removesuffix(" m"))
        assert wave == pytest.approx(speeds[f.file] / f.value, rel=0.05)


def test_a_channel_that_holds_one_value_for_a_second_is_told_with_its_place():
    t = np.arange(2000) * 0.005
    x = np.sin(t)
    short, long = (np.where((t >= 4.0) & (t < 4.0 + length), 0.5, x) for length in (0.9, 3.0))
    assert _stuck("run", "e1", short, t, 200.0) == []
    (found,) = _stuck("run", "e1", long, t, 200.0)
    assert (found.channel, found.value, found.start, found.end) == ("e1", 3.0, 4.0, 7.0)
    assert _stuck("run", "Qy", 0.0 * t, t, 200.0) == []  # a coach that does not push


def test_rows_that_are_not_used_are_told_as_a_share():
    assert _gaps("run", {"rows": 200, "gaps": 0, "nan_rows": 0, "unused_rows": 0}) == []
    (found,) = _gaps("run", {"rows": 200, "gaps": 2, "nan_rows": 3, "unused_rows": 5})
    assert found.value == 2 and "2.5 % of the rows" in found.text


def test_nothing_that_a_linear_vehicle_could_not_follow_is_left_without_an_effect():
    rest = {f.channel: f.value for f in check_data(made().measurement) if f.check == "ceiling"}
    assert max(rest.values()) < 0.3
    play = made("free_play at=primary_lateral half_width=4e-4").measurement
    worse = {f.channel: f.value for f in check_data(play) if f.check == "ceiling"}
    assert all(worse[c] > 1.2 * rest[c] for c in ("ayf", "d1"))
