"""Draw the README's figure of the errors from the report that `make run` has written."""

import json
from pathlib import Path

from railui.report.loop.figures import error_bars

HERE = Path(__file__).parent
REPORT = HERE.parent / "railui-loop" / "worn_axle_box" / "loop.json"

if __name__ == "__main__":
    (HERE / "before_after.svg").write_bytes(error_bars(json.loads(REPORT.read_text())).svg)
