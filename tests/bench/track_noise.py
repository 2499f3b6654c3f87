"""Loops of the bundled campaign with more noise in its track record.

python -m tests.bench.track_noise [--write docs/sensors.md]

The campaign is simulated; its track record has noise of 0.02 mm (`yw`) and 0.02 mrad (`phiw`). Independent noise of the
same band is added to both, and the campaign states the noise of the sum, so that the loop knows it.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import railui
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from tests.bench.growth import markdown_table
from tests.truth.files import UNITS, write_run
from tests.truth.tracks import recorder_noise

SOURCE = Path(__file__).parents[2] / "designs/campaigns/worn_axle_box"
BEGIN, END = "<!-- track noise -->\n", "<!-- end of track noise -->"  # in the page
COLUMNS = {"yw": "mm", "phiw": "mrad"}
BUNDLED = 0.02  # mm, mrad: noise of both columns in the bundled campaign
SHORTEST = 2.5  # m: wavelength down to which its recorder has noise
LEVELS = (0.02, 0.1, 0.3)  # mm, mrad
REALISATIONS = (1, 2, 3)
TRUE_HALF_WIDTH = 0.45  # mm
HEADER = (
    "track noise, mm and mrad",
    "realisation",
    "verdict",
    "effects named",
    "half-width, mm",
    "NRMSE before",
    "after",
    "noise floor",
)
Row = tuple[str, ...]


def write_noisier_campaign(folder: Path, level: float, realisation: int) -> None:
    """Write the bundled campaign with track noise of a level [mm, mrad] into a folder."""
    shutil.copytree(SOURCE, folder)
    path = folder / "campaign.yaml"
    text = path.read_text("utf-8")
    for column, unit in COLUMNS.items():
        text, count = re.subn(rf"\b{column}: {BUNDLED:g} {unit}\b", f"{column}: {level:g} {unit}", text)
        assert count == 1
    added = 1e-3 * float(np.sqrt(level**2 - BUNDLED**2))
    for index, run in enumerate(read_dataset(load_campaign(folder)).runs):
        columns = dict(run.columns)
        for number, column in enumerate(COLUMNS):
            rng = np.random.default_rng([realisation, index, number])
            columns[column] = columns[column] + recorder_noise(columns["s"], added, SHORTEST, rng)
        name = f"run_{'ab'[index]}.csv.gz"
        write_run(folder / name, {c: columns[c] for c in UNITS if c in columns}, UNITS)
    path.write_text(text, "utf-8")


def loop_report(level: float, realisation: int, jobs: int | None = None) -> dict[str, Any]:
    """Return the report of the loop on the campaign with track noise of a level."""
    if level == BUNDLED:
        return dict(railui.Campaign.load(SOURCE).loop(jobs=jobs).data)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "campaign"
        write_noisier_campaign(folder, level, realisation)
        return dict(railui.Campaign.load(folder).loop(jobs=jobs).data)


def rows(levels: Sequence[float] = LEVELS, realisations: Sequence[int] = REALISATIONS) -> Iterator[Row]:
    """Yield the rows of the table; the bundled campaign as it is has one realisation."""
    for level in levels:
        for realisation in realisations[:1] if level == BUNDLED else realisations:
            yield row(level, realisation, loop_report(level, realisation))


def row(level: float, realisation: int, report: dict[str, Any]) -> Row:
    """Return a loop as a row of the table."""
    names = [f"`{e['kind']}` at `{e['at']}`" for e in report["effects"]]
    widths = [e["parameters"]["half_width"] for e in report["effects"] if e["kind"] == "free_play"]
    widths_text = ", ".join(f"{1e3 * x['value']:.3f} ± {1e3 * x['sd']:.3f}" for x in widths) or "-"
    errors = (f"{report[key]['nrmse']:.3f}" for key in ("before", "after", "floor"))
    label = "as bundled" if level == BUNDLED else str(realisation)
    return (f"{level:g}", label, f"`{report['verdict']}`", ", ".join(names) or "-", widths_text, *errors)


def page_text(found: Sequence[Row]) -> str:
    """Return the text between the marks of the page."""
    return f"\n{markdown_table(HEADER, found)}\n\n"


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", type=Path, help="page whose table is replaced")
    options = parser.parse_args()
    found = []
    for each in rows():
        print(" | ".join(each), flush=True)
        found.append(each)
    if options.write:
        before, _, rest = options.write.read_text("utf-8").partition(BEGIN)
        text = f"{before}{BEGIN}{page_text(found)}{END}{rest.partition(END)[2]}"
        options.write.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
