"""Note of the loop report on motions that the estimation runs do not reach."""

from __future__ import annotations

import numpy as np

from railui.identification.result import LoopResult

DISPLACEMENTS = ("e1", "e2", "d1", "d2", "z")
UNREACHED_RATIO = 1.3  # of the motion on the validation runs to that on the estimation runs


def unreached_motion_notes(result: LoopResult) -> list[str]:
    """Return a note where the validation runs move beyond the motion of the estimation runs and something is left."""
    if result.verdict not in ("outside", "partial"):
        return []
    notes = []
    for channel in sorted({c for s in result.dataset.selection for c in s.channels if c in DISPLACEMENTS}):
        adjusted, validated = (
            max((float(np.ptp(s.columns[channel])) / 2 for s in segments if channel in s.columns), default=0.0)
            for segments in (result.dataset.estimation, result.dataset.selection)
        )
        if 0.0 < UNREACHED_RATIO * adjusted < validated:
            notes.append(
                f"{channel} moves by {1e3 * validated:.3g} mm on the validation runs, by {1e3 * adjusted:.3g} mm at "
                "most on the estimation runs: a law that acts only beyond is not estimated; give a run that reaches it "
                "the role adjust"
            )
    return notes
