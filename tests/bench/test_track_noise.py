"""docs/sensors.md: the loops with more noise in the track record are those last computed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from railui.runs.run import load_run
from tests.bench.track_noise import BEGIN, BUNDLED, END, LEVELS, REALISATIONS, SOURCE, Row, rows, write_noisier_campaign
from tests.docs.transcript import ROOT, outputs_agree


def written_rows() -> list[Row]:
    """Return the rows of the table in the page."""
    text = (ROOT / "docs/sensors.md").read_text("utf-8").partition(BEGIN)[2].partition(END)[0]
    lines = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| 0")]
    return [tuple(line) for line in lines]


def test_the_page_has_a_row_for_every_loop() -> None:
    expected = [(x, k) for x in LEVELS for k in (("as bundled",) if x == BUNDLED else map(str, REALISATIONS))]
    assert [(float(row[0]), row[1]) for row in written_rows()] == expected


def test_the_campaign_has_the_track_noise_that_it_states(tmp_path: Path) -> None:
    write_noisier_campaign(tmp_path / "noisier", 0.1, 1)
    stated = re.findall(r"(yw|phiw): ([\d.]+) m", (tmp_path / "noisier/campaign.yaml").read_text("utf-8"))
    assert stated == [("yw", "0.1"), ("phiw", "0.1")]
    before, after = (load_run(folder / "run_a.csv.gz").columns for folder in (SOURCE, tmp_path / "noisier"))
    for column in ("yw", "phiw"):
        assert np.std(after[column] - before[column]) == pytest.approx(1e-4 * np.sqrt(1.0 - 0.2**2), rel=0.05)
    assert np.array_equal(after["gauge"], before["gauge"]) and np.array_equal(after["d1"], before["d1"])


@pytest.mark.slow
def test_the_loops_are_those_of_the_page() -> None:
    for written, found in zip(written_rows(), rows(), strict=True):
        assert outputs_agree([" ".join(written)], [" ".join(found)], 0.1)
