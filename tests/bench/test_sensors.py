"""docs/sensors.md: its tables are those last computed, its sample is a run, its signs are those of the data."""

from __future__ import annotations

import gzip
import json
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.campaign.noise.relations import differentiate
from railui.core import Spline
from railui.identification.estimation.calibration import calibrate
from railui.runs.columns import COLUMNS
from railui.runs.run import load_run
from tests.bench.page import MARK
from tests.bench.sensor_delays import delay_limits
from tests.bench.sensor_sets import Identified, identify, with_channels
from tests.bench.sensor_tables import SHOWN, effect_ratios, is_inverse, nested_pairs, page_text
from tests.bench.sensors import FIGURES, measure
from tests.blind.faults import PlantedFault, retimed, with_faults
from tests.blind.simulated import simulated_campaign

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/sensors.md").read_text("utf-8")
BUNDLED = ROOT / "designs/campaigns/worn_axle_box/run_b.csv.gz"
SETS = (("ayf",), ("ayf", "rf"))
SECONDS = (18.0, 15.0)
HALF_WHEELBASE, RADIUS, HIGHEST = 1.28, 0.46, 20.0  # m, m, Hz


def test_the_tables_of_the_page_are_those_last_computed() -> None:
    written = PAGE[PAGE.index(MARK) :].split("\n", 2)[2]
    assert written == page_text(json.loads(FIGURES.read_text("utf-8")))


@pytest.fixture(scope="module")
def figures() -> dict[str, Any]:
    """Figures of two sets on a short campaign, as stored."""
    found = measure(simulated_campaign(seconds=SECONDS).dataset, SETS, SETS[:1], jobs=2)
    return json.loads(json.dumps(found | {"date": "today", "commit": "this", "seed": 3}))


def test_a_short_campaign_has_all_tables(figures: dict[str, Any]) -> None:
    text = page_text(figures)
    assert [title for title in re.findall("## (.*)", text)] == re.findall("## (.*)", PAGE[PAGE.index(MARK) :])
    assert all(f"| {shown.label}:" in text for shown in SHOWN)
    assert len(figures["sets"][0]["parameters"]) == 17
    for row in figures["sets"]:
        assert row["error"] == pytest.approx(row["floor"], rel=0.3)
        assert set(row["delays"]) == {*row["channels"], "track"}
    # one channel is in no relation: the response to the track shows 50 ms, and 20 ms of the track, which are 0.8 m
    assert figures["sets"][0]["reported_delays"] == {"ayf": 0.05, "track": 0.02}


def test_the_yaw_rate_lowers_the_limits_of_effects_in_yaw(figures: dict[str, Any]) -> None:
    assert nested_pairs(figures["sets"]) == [(0, 1)]
    ratios = effect_ratios(*figures["sets"], "value")
    assert ratios["dry friction, primary yaw"] < 0.5 and ratios["dry friction, secondary yaw"] < 0.8


def test_a_friction_coefficient_limits_the_effect_from_above() -> None:
    assert is_inverse("creep_saturation", "friction") and is_inverse("rail_flexibility", "stiffness")
    assert not is_inverse("dry_friction", "force") and not is_inverse("spring", "stiffness")


def test_the_predicted_shift_by_a_delay_is_that_of_a_calibration() -> None:
    delay, channels = 2e-4, ("ayf", "rf", "d1", "d2")
    dataset = with_channels(simulated_campaign(seconds=SECONDS).dataset, channels)
    result = identify(dataset, channels, jobs=2)
    limits = delay_limits(result)["rf"]
    late = with_faults(dataset, [PlantedFault("delay", ("rf",), "", retimed("rf", delay=delay))])
    shift = _estimate(result, late, limits.shifted) / _estimate(result, dataset, limits.shifted) - 1.0
    assert abs(shift) == pytest.approx(limits.shift * delay, rel=0.3)


def _estimate(result: Identified, dataset: Any, path: str) -> float:
    """Estimate of a parameter from a dataset."""
    fit = calibrate(replace(result.context, dataset=dataset))
    return float(fit.x[fit.free.paths.index(path)])


def _sample() -> list[str]:
    return re.findall(r"```csv\n(.*?)```", PAGE, re.DOTALL)[0].splitlines()


def test_the_sample_is_the_start_of_a_run_that_is_read(tmp_path: Path) -> None:
    rest = gzip.decompress(BUNDLED.read_bytes()).decode().splitlines()
    sample = _sample()
    assert len(sample) == 5
    path = tmp_path / "run.csv"
    path.write_text("\n".join([*sample, *rest[5:]]) + "\n")
    run = load_run(path)
    numbers = np.array([[float(x) for x in line.split(",")] for line in sample[1:]])
    for name, column in zip(re.findall(r"(\w+) \[", sample[0]), numbers.T, strict=True):
        assert run.columns[name][:4] == pytest.approx(column)
    assert run.responses == ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2") and not run.notes


def test_the_table_of_columns_has_their_names_and_units() -> None:
    rows = re.findall(r"^\| (\w+) \| (\S+) \| [^|]+ \| [^|]*\|$", PAGE[: PAGE.index(MARK)], re.MULTILINE)
    usual = [c for c in COLUMNS.values() if c.role != "coach" and not c.name.startswith("psi")]
    assert dict(rows) == {"column": "unit"} | {c.name: c.unit for c in usual}


def test_the_picture_names_every_channel() -> None:
    picture = ElementTree.fromstring((ROOT / "docs/axes.svg").read_text("utf-8"))
    words = " ".join(x.text or "" for x in picture.iter("{http://www.w3.org/2000/svg}text"))
    for name in ("yw", "phiw", "gauge", "e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2", "x", "y", "z"):
        assert re.search(rf"\b{name}\b", words), name


def test_the_bundled_run_has_the_signs_of_the_page() -> None:
    c = load_run(BUNDLED).columns
    dt = float(c["t"][1] - c["t"][0])
    rails = Spline(c["s"], c["yw"] + RADIUS * c["phiw"])
    y_1 = c["e1"] + rails(c["s"])
    y_2 = c["e2"] + rails(np.clip(c["s"] - 2 * HALF_WHEELBASE, c["s"][0], c["s"][-1]))
    psi = (y_1 - y_2 - c["d1"] + c["d2"]) / (2 * HALF_WHEELBASE)
    y = 0.5 * (y_1 + y_2 - c["d1"] - c["d2"])
    pairs = {"ay1": (y_1, 2), "ay2": (y_2, 2), "ayf": (y, 2), "rf": (psi, 1)}
    for name, (motion, order) in pairs.items():
        expected, found = differentiate(motion, dt, order, HIGHEST), differentiate(c[name], dt, 0, HIGHEST)
        assert np.polyfit(expected, found, 1)[0] == pytest.approx(1.0, abs=0.25), name
        assert np.corrcoef(expected, found)[0, 1] > 0.8, name
