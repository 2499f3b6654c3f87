"""A loop on the first seconds of the bundled campaign, its report and its page."""

from __future__ import annotations

import gzip
import shutil
from pathlib import Path
from typing import Any

import pytest

from railui import core
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.loop import close_loop
from railui.identification.result import LoopResult
from railui.report.loop.data import loop_report
from tests.report.loop.names import CAMPAIGN_NAME

CAMPAIGN = Path(__file__).parents[3] / "designs" / "campaigns" / "worn_axle_box"
SECONDS = 15
CANDIDATES = ("free_play", "cubic_stiffness", "sensor_gain")


def shortened_campaign(directory: Path) -> Path:
    """Write the first seconds of the bundled campaign, with a name that needs escaping."""
    shutil.copy(CAMPAIGN / "vehicle.yaml", directory)
    text = (CAMPAIGN / "campaign.yaml").read_text(encoding="utf-8")
    renamed = text.replace("name: worn axle box", f"name: '{CAMPAIGN_NAME}'")
    assert renamed != text
    (directory / "campaign.yaml").write_text(renamed, encoding="utf-8")
    for name in ("run_a.csv.gz", "run_b.csv.gz"):
        lines = gzip.decompress((CAMPAIGN / name).read_bytes()).decode("utf-8").splitlines()
        rows = next(i for i, line in enumerate(lines[1:]) if float(line.split(",")[0]) >= SECONDS)
        (directory / name).write_bytes(gzip.compress("\n".join(lines[: rows + 1]).encode("utf-8") + b"\n"))
    return directory


@pytest.fixture(scope="session")
def loop_result(tmp_path_factory: pytest.TempPathFactory) -> LoopResult:
    excluded = [r["kind"] for r in core.effect_catalogue() if r["kind"] not in CANDIDATES]
    campaign = load_campaign(shortened_campaign(tmp_path_factory.mktemp("campaign")))
    return close_loop(read_dataset(campaign), without=excluded, jobs=2)


@pytest.fixture(scope="session")
def report(loop_result: LoopResult) -> dict[str, Any]:
    return loop_report(loop_result)
