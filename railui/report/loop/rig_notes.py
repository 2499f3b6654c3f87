"""Notes of the loop report on rigs: filters of their records, noise of their input, and an input recorded late."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.dataset import Dataset
from railui.identification.result import LoopResult


def filter_notes(dataset: Dataset) -> list[str]:
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


def unstated_input_noise_notes(result: LoopResult) -> list[str]:
    """Return a warning where a rig leaves a residual and no noise of its input is stated."""
    segments = result.dataset.segments
    is_driven = all(s.kind == "rig" for s in segments) and any(np.any(s.columns.get("u", 0.0)) for s in segments)
    known = {**result.dataset.campaign.noise, **result.context.noise}
    if not is_driven or known.get("u") or result.verdict not in ("outside", "partial"):
        return []
    return [
        "no noise is stated for the input u: taken as zero. Noise of its record moves the model as an unmeasured force "
        "moves the rig; state it (`noise: {u: ...}`) before the residual is taken for one"
    ]


def late_input_notes(result: LoopResult) -> list[str]:
    """Return a note where all of several channels of a rig have the same delay: the input is recorded late or early."""
    effects, dataset = result.after.model.effects, result.dataset
    delays = {e.at: float(e.parameters["delay"]) for e in effects if e.kind == "sensor_delay"}  # type: ignore[arg-type]
    channels = {c for s in dataset.segments for c in s.channels}
    if len(channels) < 2 or set(delays) != channels or not all(s.kind == "rig" for s in dataset.segments):
        return []
    mean = float(np.mean(list(delays.values())))
    tolerance = result.context.settings.notes.late_input_tolerance
    if any(abs(x - mean) > tolerance * abs(mean) for x in delays.values()):
        return []
    late, size = ("late" if mean < 0.0 else "early"), 1e3 * abs(mean)
    return [
        f"{', '.join(sorted(delays))} have the same delay: not they, but the input u is recorded {size:.3g} ms {late}; "
        f"correct it by `sensors: {{u: {{delay: {-1e3 * mean:.3g} ms}}}}`"
    ]


def held_input_notes(result: LoopResult) -> list[str]:
    """Return a note where the delay of a rig's channels is that of an input held between coarse samples."""
    settings, dataset = result.context.settings.notes, result.dataset
    driven = [s for s in dataset.estimation if s.kind == "rig" and np.any(s.columns.get("u", 0.0))]
    if not driven or min(_relative_step(s.columns["u"]) for s in driven) < settings.min_held_step:
        return []
    half = 0.5 * float(np.mean([s.dt for s in driven]))
    delays = {e.at: e.parameters["delay"] for e in result.after.model.effects if e.kind == "sensor_delay"}
    late = [
        at
        for at, delay in delays.items()
        if isinstance(delay, float) and abs(delay - half) <= settings.held_input_tolerance * half
    ]
    if not late:
        return []
    return [
        f"the delay of {', '.join(late)} is half an interval between samples, {1e3 * half:.3g} ms, and the input u "
        "changes much from one sample to the next: so does a response to an input that a converter holds (zero-order "
        "hold), since the input counts as interpolated; record u as it acts, at several times the rate, before the "
        f"sensor is blamed, or correct its mean delay by `sensors: {{u: {{delay: {-1e3 * half:.3g} ms}}}}`"
    ]


def _relative_step(u: FloatArray) -> float:
    """Rms difference of successive samples over the standard deviation."""
    return float(np.sqrt(np.mean(np.diff(u) ** 2)) / max(float(np.std(u)), 1e-300))


def late_force_notes(result: LoopResult) -> list[str]:
    """Return a note where the force of a component is late: its mounting may yield."""
    if result.nominal.design.form != "bench":
        return []
    delays = [e.parameters["delay"] for e in result.after.model.effects if e.kind == "sensor_delay" and e.at == "F"]
    return [
        f"the force F is {1e3 * delay:.3g} ms late: a rubber mounting in series with the component delays it alike; "
        "check the mounting (`maxwell_damper`) before the recorder; runs over a wider band of frequencies tell these "
        "apart"
        for delay in delays
        if isinstance(delay, float) and delay > 0.0
    ]
