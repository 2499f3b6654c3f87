"""Faults in words."""

from __future__ import annotations

import numpy as np

from railui.campaign.faults.hypotheses import RADIAN, G, Hypothesis
from railui.runs.columns import BENCH_COLUMNS, COLUMNS, RIG_COLUMNS

# the vehicle is symmetric about its vertical plane
EQUIVALENT_TO_CROSS_LEVEL = "or every other lateral and yaw channel has (`convention` of a sensor map)"
UNITS = {"sign": "1", "unit": "1", "gain": "1", "delay": "s", "clock": "1", "offset": "m", "gravity": "m/s^2"}


def channel_names(channels: tuple[str, ...]) -> str:
    """Return channels with what they measure.

    >>> channel_names(("rf",)), channel_names(("e1", "e2"))
    ('yaw rate of the frame rf', 'e1, e2')
    """
    if len(channels) > 1:
        return ", ".join(channels)
    known = COLUMNS.get(channels[0]) or RIG_COLUMNS.get(channels[0]) or BENCH_COLUMNS.get(channels[0])
    return f"{known.caption} {channels[0]}" if known else channels[0]


def fault_text(h: Hypothesis) -> str:
    """Return a fault as a clause.

    >>> fault_text(Hypothesis("sign", ("rf",), -1.0))
    'yaw rate of the frame rf has the wrong sign'
    >>> fault_text(Hypothesis("exchanged", ("e1", "ay1", "ay2", "e2")))
    'e1, ay1 and e2, ay2 are exchanged one by one'
    """
    names, verb = channel_names(h.channels), "have" if len(h.channels) > 1 else "has"
    if h.kind == "sign":
        text = f"{names} {verb} the wrong sign"
        return f"{text}, {EQUIVALENT_TO_CROSS_LEVEL}" if h.channels == ("phiw",) else text
    if h.kind == "unit":
        return f"{names} {verb} numbers in another unit: {_unit_text(h)}"
    if h.kind == "gain":
        return f"{names} {'are' if len(h.channels) > 1 else 'is'} recorded {h.value:.3g} times too large"
    if h.kind == "exchanged":
        half = len(h.channels) // 2
        first, second = ", ".join(h.channels[:half]), ", ".join(h.channels[: half - 1 : -1])
        return f"{first} and {second} are exchanged" + (" one by one" if half > 1 else "")
    if h.kind == "gravity":
        return f"{names} contains gravity through roll ({h.value:.3g} m/s^2 per rad of cross-level)"
    if h.kind == "offset":
        late = "further along the line" if h.value > 0 else "earlier on the line"
        return f"the track is recorded {abs(h.value):.3g} m {late} than the vehicle met it"
    if h.kind == "clock":
        return f"{names}: the clock runs {1e6 * abs(h.value):.0f} ppm {'fast' if h.value > 0 else 'slow'}" + (
            f", from {1e3 * h.delay:.1f} ms at the start" if abs(h.delay) > 1e-3 else ""
        )
    late = "late" if h.value > 0 else "early"
    return f"{names} {'are' if len(h.channels) > 1 else 'is'} {1e3 * abs(h.value):.1f} ms {late}"


def _unit_text(h: Hypothesis) -> str:
    for gain, text in ((RADIAN, "degrees"), (1.0 / RADIAN, "radians where degrees are stated")):
        if np.isclose(h.value, gain):
            return text
    for gain, text in ((1.0 / G, "g"), (G, "m/s^2 where g is stated")):
        if np.isclose(h.value, gain) and h.channels[0].startswith("a"):
            return text
    return f"{h.value:g} times the stated one" if h.value < 1 else f"the values are {h.value:g} times too large"
