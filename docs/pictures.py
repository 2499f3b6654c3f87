"""Draw the README's figure of the errors from the report of `make run`."""

import json
from pathlib import Path

from railui.report.loop.figures import error_bars

DOCS = Path(__file__).parent
REPORT = DOCS.parent / "railui-loop" / "worn_axle_box" / "loop.json"

if __name__ == "__main__":
    (DOCS / "before_after.svg").write_bytes(error_bars(json.loads(REPORT.read_text())).svg)
