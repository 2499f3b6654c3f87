"""Draw the figures of README and docs/vehicles.md from the reports of the loop on bundled campaigns.

`make run` writes the first report, `railui loop designs/campaigns/worn_centre_guide -o railui-loop/worn_centre_guide` the
second.
"""

import json
from pathlib import Path

from railui.campaign.campaign import load_campaign
from railui.report.loop.figures import error_bars
from railui.report.schematic.subjects import schematic_of_report
from railui.runs.run import load_run

DOCS = Path(__file__).parent
LOOPS, CAMPAIGNS = DOCS.parent / "railui-loop", DOCS.parent / "designs" / "campaigns"


def report_of(name: str) -> dict:
    """Return loop.json of a bundled campaign."""
    return json.loads((LOOPS / name / "loop.json").read_text("utf-8"))


def schematic(name: str) -> bytes:
    """Return the vehicle of a bundled campaign with its sensors and the effects that the loop added."""
    campaign = load_campaign(CAMPAIGNS / name)
    columns = [column for entry in campaign.runs for column in load_run(entry.file, campaign.design.run_form).columns]
    return schematic_of_report(campaign.design, campaign, columns, report_of(name)).svg


if __name__ == "__main__":
    (DOCS / "before_after.svg").write_bytes(error_bars(report_of("worn_axle_box")).svg)
    (DOCS / "worn_axle_box.svg").write_bytes(schematic("worn_axle_box"))
    (DOCS / "worn_centre_guide.svg").write_bytes(schematic("worn_centre_guide"))
