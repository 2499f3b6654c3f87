"""Compute what sets of sensors determine and detect, and the delay and noise that they tolerate.

python -m tests.bench.sensors [--write docs/sensors.md]

One simulated campaign without an unmodelled effect is identified with each set. The figures are stored in
tests/bench/sensors.json, from which the page is written.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from railui.bench.benchmark_log import source_commit
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from tests.bench.page import write_after
from tests.bench.sensor_delays import channel_noise, delay_limits, reported_delay
from tests.bench.sensor_sets import SENSOR_SETS, Identified, identify
from tests.bench.sensor_tables import page_text
from tests.truth.campaign import Order, campaign, write

FIGURES = Path(__file__).with_name("sensors.json")
SEED = 3
DELAYS_OF = (SENSOR_SETS[0], SENSOR_SETS[3], SENSOR_SETS[-1])  # sets for which delays are planted and checked


def simulated_dataset(seed: int = SEED, **options: Any) -> Dataset:
    """Simulate a campaign without an unmodelled effect by the independent generator, and read it."""
    with tempfile.TemporaryDirectory() as folder:
        write(campaign(Order(name="sensors", seed=seed, **options)), Path(folder))
        return read_dataset(load_campaign(folder))


def measure(
    dataset: Dataset, sets: Sequence[tuple[str, ...]], delays_of: Sequence[tuple[str, ...]], jobs: int | None = None
) -> dict[str, Any]:
    """Identify a campaign with each set of sensors and return the figures of the page."""
    durations = [s.samples * s.dt for s in dataset.segments]
    speeds = [s.mean_speed for s in dataset.segments]
    rows = [_figures(identify(dataset, channels, jobs), channels in delays_of) for channels in sets]
    return {"durations": durations, "speeds": speeds, "sets": rows}


def _figures(result: Identified, plants_delays: bool) -> dict[str, Any]:
    """Figures of one set; planted delays take most of the time."""
    alone = {_key(row): row["value"] for row in result.significant}
    effects = [
        {k: row[k] for k in ("kind", "at", "wheelset", "parameter", "unit", "value")} | {"score_only": alone[_key(row)]}
        for row in result.detectable
    ]
    limits = delay_limits(result)
    checked = {name: reported_delay(result.context.dataset, name) for name in limits} if plants_delays else None
    return {
        "channels": result.channels,
        "error": result.error,
        "floor": result.floor.nrmse,
        "effects": effects,
        "parameters": {path: {"class": word, "sd": sd} for path, word, sd, _ in result.identifiability.classes},
        "delays": {name: asdict(x) for name, x in limits.items()},
        "reported_delays": checked,
        "noise": {c: asdict(x) for c, x in channel_noise(result).items()},
    }


def _key(row: dict[str, Any]) -> tuple[str, str, int | None]:
    return row["kind"], row["at"], row["wheelset"]


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", type=Path, help="page whose results are replaced")
    options = parser.parse_args()
    figures = measure(simulated_dataset(), SENSOR_SETS, DELAYS_OF)
    figures |= {"date": f"{datetime.now(UTC):%Y-%m-%d}", "commit": source_commit(), "seed": SEED}
    stored = json.dumps(figures, indent=1) + "\n"
    text = page_text(json.loads(stored))
    print(text)
    if options.write:
        FIGURES.write_text(stored, "utf-8")
        write_after(options.write, text)


if __name__ == "__main__":
    main()
