"""Datum and heading of a recorded alignment, which a bogie's springs to the ground must not feel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import load_campaign_run
from railui.campaign.settings.noise import NoiseSettings
from railui.campaign.track_datum import with_datum_removed
from railui.runs.run import Run

REPOSITORY = Path(__file__).parents[2]
SETTINGS = NoiseSettings()


@pytest.fixture(scope="module")
def run() -> Run:
    campaign = load_campaign(REPOSITORY / "designs/campaigns/worn_axle_box/campaign.yaml")
    return load_campaign_run(campaign, campaign.runs[1])


def shifted(run: Run, offset: float, heading: float) -> Run:
    s = run.columns["s"]
    return replace(run, columns={**run.columns, "yw": run.columns["yw"] + offset + heading * (s - s[0])})


def test_a_record_with_a_datum_of_its_own_is_unchanged(run: Run) -> None:
    assert with_datum_removed(run, SETTINGS) is run


@pytest.mark.parametrize(("offset", "heading"), [(0.01, 0.0), (-0.3, 0.0), (0.0, 2e-5), (1.0, -1e-3)])
def test_an_arbitrary_datum_or_heading_is_removed(run: Run, offset: float, heading: float) -> None:
    found = with_datum_removed(shifted(run, offset, heading), SETTINGS)
    assert np.abs(found.columns["yw"] - run.columns["yw"]).max() < 5e-5  # the mean line that the irregularities have
    assert "offset" in found.notes[-1] and ("heading" in found.notes[-1]) == (heading != 0.0)


def test_the_distance_may_be_missing(run: Run) -> None:
    moved = shifted(run, 0.05, 1e-4)
    columns = {name: x for name, x in moved.columns.items() if name != "s"}
    found = with_datum_removed(replace(moved, columns=columns), SETTINGS)
    assert np.abs(found.columns["yw"] - run.columns["yw"]).max() < 5e-5


def test_the_mean_line_of_a_short_run_may_be_an_irregularity(run: Run) -> None:
    rows = run.columns["s"] - run.columns["s"][0] < 100.0
    short = replace(run, columns={name: x[rows] for name, x in run.columns.items()})
    rms = float(np.std(short.columns["yw"]))
    assert with_datum_removed(shifted(short, 3.0 * rms, 0.0), SETTINGS).notes == run.notes
    assert len(with_datum_removed(shifted(short, 0.2, 0.0), SETTINGS).notes) == len(run.notes) + 1


def test_rows_without_values_stay_so(run: Run) -> None:
    moved = shifted(run, 0.05, 0.0)
    moved.columns["yw"][100:120] = np.nan
    found = with_datum_removed(moved, SETTINGS)
    assert np.array_equal(np.isnan(found.columns["yw"]), np.isnan(moved.columns["yw"])) and found.notes != run.notes
