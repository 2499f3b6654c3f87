"""Notes of the loop report on the records of rigs: drift that is not compared, and noise of prescribed motions."""

from __future__ import annotations

from railui.campaign.dataset import Dataset


def rig_notes(dataset: Dataset) -> list[str]:
    """Return how the records of a rig were filtered before the comparison."""
    notes = []
    limits = [s.drift_limit for s in dataset.segments if s.drift_limit]
    if limits:
        notes.append(f"the sensors drift in the free decays, which are compared above {min(limits):.3g} Hz")
    edges = [edge for s in dataset.segments for edge in s.motion_bandwidth.values()]
    if edges:
        columns = sorted({c for s in dataset.segments for c in s.motion_bandwidth})
        width = f"{min(edges):.3g}" if min(edges) == max(edges) else f"{min(edges):.3g} to {max(edges):.3g}"
        notes.append(f"the prescribed motion ({', '.join(columns)}) is noisy: taken below a low-pass at {width} Hz")
    return notes
