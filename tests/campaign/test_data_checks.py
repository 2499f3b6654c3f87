"""Data checks: each fault is reported with its channel; sound data give no finding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from railui.campaign.data_checks import check_data, check_gaps, check_stuck
from railui.campaign.dataset import Dataset
from railui.campaign.finding import Finding
from tests.blind.simulated import simulated_campaign

Change = Callable[[np.ndarray, np.ndarray], np.ndarray]


def findings_with(channel: str, change: Change) -> list[Finding]:
    """Findings after a channel has been changed in every run."""
    dataset: Dataset = simulated_campaign().dataset
    segments = tuple(
        replace(s, columns={**s.columns, channel: change(s.columns[channel], s.columns["t"])}, tables={})
        for s in dataset.segments
    )
    return [f for f in check_data(replace(dataset, segments=segments)) if f.check != "ceiling"]


def test_sound_data_give_no_finding():
    assert [f for f in check_data(simulated_campaign().dataset) if f.check != "ceiling"] == []


def test_a_late_channel_is_reported_with_its_delay_and_is_not_serious():
    (finding,) = findings_with("e1", lambda x, t: np.interp(t - 0.012, t, x))
    assert (finding.check, finding.channel, finding.serious) == ("clock", "e1", False)
    assert finding.value == pytest.approx(0.012, abs=1e-3)


def test_a_wrong_gain_is_reported_with_its_size_and_is_not_serious():
    (finding,) = findings_with("d1", lambda x, t: 1.4 * x)
    assert (finding.check, finding.channel, finding.serious) == ("gain", "d1", False)
    assert finding.value == pytest.approx(1.4, rel=0.03)


def test_a_clipped_channel_is_reported_with_its_share():
    (finding,) = findings_with("d2", lambda x, t: np.clip(x, -x.std(), x.std()))
    # a Gaussian channel is beyond one standard deviation for 32 % of the time
    assert (finding.check, finding.channel, finding.serious) == ("clipping", "d2", True)
    assert 0.15 < finding.value < 0.45


def test_a_section_of_hunting_is_reported_with_its_frequency():
    def add_hunting(x: np.ndarray, t: np.ndarray) -> np.ndarray:
        return x + np.where((t > 8.0) & (t < 12.0), 20.0 * x.std() * np.sin(2 * np.pi * 3.0 * t), 0.0)

    findings = [f for f in findings_with("ay1", add_hunting) if f.check == "hunting"]
    assert findings
    assert all(f.value == pytest.approx(3.0, abs=0.3) for f in findings)
    speeds = {s.file: s.mean_speed for s in simulated_campaign().dataset.segments}
    for f in findings:
        wavelength = float(f.text.rpartition("wavelength ")[2].removesuffix(" m"))
        assert wavelength == pytest.approx(speeds[f.file] / f.value, rel=0.05)


def test_a_channel_constant_for_a_second_is_reported_with_its_time():
    t = np.arange(2000) * 0.005
    x = np.sin(t)
    short, long = (np.where((t >= 4.0) & (t < 4.0 + length), 0.5, x) for length in (0.9, 3.0))
    assert check_stuck("run", "e1", short, t, 200.0, "bogie") == []
    (finding,) = check_stuck("run", "e1", long, t, 200.0, "bogie")
    assert (finding.channel, finding.value, finding.start, finding.end) == ("e1", 3.0, 4.0, 7.0)
    assert check_stuck("run", "Qy", 0.0 * t, t, 200.0, "bogie") == []  # a force that is zero throughout


def test_a_slow_record_of_a_rig_may_repeat_a_value():
    t = np.arange(500) * 4.0
    x = np.round(np.sin(2 * np.pi * t / 400.0), 2)  # three equal samples, of 12 s, at its extremes
    assert check_stuck("run", "z", x, t, 0.25, "rig") == []


def test_unused_rows_are_reported_as_a_share():
    assert check_gaps("run", {"rows": 200, "gaps": 0, "nan_rows": 0, "unused_rows": 0}) == []
    (finding,) = check_gaps("run", {"rows": 200, "gaps": 2, "nan_rows": 3, "unused_rows": 5})
    assert finding.value == 2 and "2 gaps, 3 rows" in finding.text and "2.5 % of the rows" in finding.text
    (finding,) = check_gaps("run", {"rows": 20000, "gaps": 1, "nan_rows": 1, "unused_rows": 2})
    assert finding.text == "1 gap, 1 row with empty cells: 0.01 % of the rows are not used"


def test_clearance_lowers_the_coherence_with_the_track():
    linear = {f.channel: f.value for f in check_data(simulated_campaign().dataset) if f.check == "ceiling"}
    assert max(linear.values()) < 0.3
    nonlinear = simulated_campaign("free_play at=primary_lateral half_width=4e-4").dataset
    limits = {f.channel: f.value for f in check_data(nonlinear) if f.check == "ceiling"}
    assert all(limits[c] > 1.2 * linear[c] for c in ("ayf", "d1"))
