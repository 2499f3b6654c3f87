"""Start of a run: a vehicle is compared from where the track under its last wheelset is known."""

from __future__ import annotations

import numpy as np

from railui.campaign.comparison import band_pass
from railui.campaign.segment import MIN_WINDOW_SAMPLES, Segment
from railui.dsp.filters import padlen
from railui.track import COLUMNS_PER_WHEELSET, FIRST_WHEELSET_COLUMN
from tests.truth.tracks import met

DISTANCES = (0.0, 2.5, 19.0, 21.5)  # m behind the leading wheelset
LAST_LATERAL = FIRST_WHEELSET_COLUMN + 3 * COLUMNS_PER_WHEELSET


def whole(lead: float = DISTANCES[-1]) -> Segment:
    run = met(40.0, 6.0, 3, "low", rate=200.0, before=0.0, spread=0.2)
    columns = {"t": run.t, "s": run.s, "v": run.v, "yw": run.yw, "phiw": run.phiw}
    return Segment("run", "adjust", 0, columns, 1 / 200.0, "bogie", unknown_lead=lead)


def test_a_run_begins_where_the_last_wheelset_meets_the_record() -> None:
    segment, s, t = whole().on_known_track(), whole().columns["s"], whole().columns["t"]
    first = int(np.searchsorted(s, s[0] + 21.5))
    assert segment.columns["t"][0] == t[first]
    assert segment.samples == len(s) - first


def test_a_trailing_wheelset_meets_the_recorded_track_from_the_first_sample_on() -> None:
    segment, recorded = whole().on_known_track(), whole().columns
    for steps in (1, 2, 4):
        for part in (segment, segment.truncated(200), segment.windows(1.0)[0]):
            table = part.table(DISTANCES, steps)
            assert len(table) == 2 * steps * (part.samples - 1) + 1
            s = part.columns["s"][:5]
            expected = np.interp(s - DISTANCES[-1], recorded["s"], recorded["yw"])
            under_last = table[: 2 * steps * 5 : 2 * steps, LAST_LATERAL]
            np.testing.assert_allclose(under_last, expected, atol=2e-6)


def test_the_windows_of_a_slowly_sampled_run_are_long_enough_for_the_comparison_filter() -> None:
    assert padlen(band_pass((0.3, 40.0), 20.0)) < MIN_WINDOW_SAMPLES
    columns = {name: x[::10] for name, x in whole().columns.items()}
    slow = Segment("run", "adjust", 0, columns, 1 / 20.0)
    windows = slow.windows(0.6)
    assert min(w.samples for w in windows) >= MIN_WINDOW_SAMPLES
    assert [w.first_sample for w in windows][1:] == list(np.cumsum([w.samples for w in windows])[:-1])
    assert len(whole(0.0).windows(0.6)) == int(whole(0.0).samples / 200.0 / 0.6)


def test_a_short_run_begins_at_its_middle_at_the_latest() -> None:
    assert whole(1e4).on_known_track().samples == whole().samples - whole().samples // 2


def test_a_bogie_is_compared_from_the_first_sample_on() -> None:
    segment = whole(0.0)
    assert segment.on_known_track() is segment
