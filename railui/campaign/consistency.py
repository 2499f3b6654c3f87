"""What measured motions owe one another whatever the vehicle is made of: clock, gain and sign of every channel.

y_i = e_i + y_wi + r phi_wi, and d_1'' = y_1'' - y'' - a psi'', d_2'' = y_2'' - y'' + a psi''.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.dataset import Segment
from railui.campaign.finding import Finding
from railui.dsp.spectra import csd, welch

SEGMENT = 2.56  # s of a segment of the spectra
BAND = (1.0, 12.0)  # Hz in which motions are held against each other
CLEAR = 0.5  # coherence from which a relation tells something
STRONG = 0.9  # and from which it tells a gain
FEWEST = 4  # frequencies that must tell it
GAIN, CLOCK = 0.08, 0.004  # least fault that is told: relative, s
GROSS = 0.3  # logarithm of a gain from which no model will fit the channel
FAULT = 4.0  # standard errors that it must exceed
TURNED = 0.2  # by which a channel must cohere better the other way round


@dataclass(frozen=True, eq=False)
class _Relation:
    """One channel and what it must equal, both as accelerations [n]; `others` are the channels in it.

    flipped: what it would have to equal were the first of the others mounted the wrong way round.
    """

    channel: str
    others: tuple[str, ...]
    measured: FloatArray
    owed: FloatArray
    flipped: FloatArray | None = None


def _twice(x: FloatArray, dt: float) -> FloatArray:
    """Second derivative [n] by central differences."""
    return np.gradient(np.gradient(x, dt), dt)


def _relations(stretch: Segment, values: Mapping[str, float]) -> list[_Relation]:
    """What the channels that were measured let one hold against each other."""
    c, dt = stretch.columns, stretch.dt
    a, r = values["vehicle.geometry.half_wheelbase"], values["vehicle.geometry.rolling_radius"]
    rails = c["yw"] + r * c.get("phiw", np.zeros_like(c["yw"]))
    out = []
    for i, behind in ((1, 0.0), (2, 2.0 * a)):
        e, ay = f"e{i}", f"ay{i}"
        if e in c and ay in c:
            under = np.interp(c["s"] - behind, c["s"], rails)
            out.append(_Relation(ay, (e,), c[ay], _twice(c[e] + under, dt), _twice(under - c[e], dt)))
    if "ayf" in c and "rf" in c:
        for i, sign in ((1, -1.0), (2, 1.0)):
            if f"d{i}" in c and f"ay{i}" in c:
                owed = c[f"ay{i}"] - c["ayf"] + sign * a * np.gradient(c["rf"], dt)
                out.append(_Relation(f"d{i}", (f"ay{i}", "ayf", "rf"), _twice(c[f"d{i}"], dt), owed))
    return out


def kinematic_checks(stretch: Segment, values: Mapping[str, float]) -> list[Finding]:
    """Clock, gain and sign of every channel that others can be held against; values: the numbers of the bogie."""
    found, sound = list[tuple[_Relation, Finding]](), set[str]()
    for relation in _relations(stretch, values):
        finding = _held(stretch, relation)
        if finding is None:
            sound |= {relation.channel, *relation.others}
        else:
            found.append((relation, finding))
    out = []
    for relation, finding in found:
        # a channel that agrees elsewhere is not the one to blame
        blamed = [c for c in (relation.channel, *relation.others) if c not in sound] or [relation.channel]
        counts = {c: sum(c in (r.channel, *r.others) for r, _ in found) for c in blamed}
        worst = finding.channel if finding.channel != relation.channel else max(blamed, key=lambda c: counts[c])
        out.append(replace(finding, channel=worst))
    return out


def _held(stretch: Segment, relation: _Relation) -> Finding | None:
    """Sign, delay or gain of a channel against what it must equal; None where they agree or nothing tells."""
    n = min(round(SEGMENT / stretch.dt), stretch.samples // 4)
    if relation.flipped is not None:
        turned, so = (_coherent(x, relation.measured, stretch.dt, n) for x in (relation.flipped, relation.owed))
        if turned > so + TURNED:
            return _wrong_way(stretch, relation.others[0], relation.channel, "tells")
    seen = _Transfer.of(stretch, relation, n)
    if seen is None:
        return None
    if float(np.average(np.real(seen.cross) < 0, weights=seen.weight)) > 0.5:
        return _wrong_way(stretch, relation.channel, ", ".join(relation.others), "tell")
    return _late(stretch, relation, seen) or _amplified(stretch, relation, seen)


def _coherent(x: FloatArray, y: FloatArray, dt: float, n: int) -> float:
    """Mean coherence of two signals in the band, from segments of n samples."""
    f, both = csd(x, y, 1.0 / dt, n)
    coherence = np.abs(both) ** 2 / (welch(x, 1.0 / dt, n)[1] * welch(y, 1.0 / dt, n)[1])
    return float(np.mean(coherence[(f >= BAND[0]) & (f <= BAND[1])]))


@dataclass(frozen=True, eq=False)
class _Transfer:
    """A channel over what it must equal, at the frequencies [n] of the band at which the two are coherent.

    w [rad/s], cross spectrum, gain (its sign that of the cross spectrum's real part), coherence; weight: the precision
    of its phase.
    """

    w: FloatArray
    cross: ComplexArray
    gain: FloatArray
    coherence: FloatArray
    weight: FloatArray

    @classmethod
    def of(cls, stretch: Segment, relation: _Relation, n: int) -> _Transfer | None:
        """From segments of n samples; None where too few frequencies tell anything."""
        rate = 1.0 / stretch.dt
        f, both = csd(relation.owed, relation.measured, rate, n)
        own, seen = (welch(x, rate, n)[1] for x in (relation.owed, relation.measured))
        coherence = np.abs(both) ** 2 / np.maximum(own * seen, 1e-300)
        kept = (f >= BAND[0]) & (f <= BAND[1]) & (coherence > CLEAR)
        if kept.sum() < FEWEST:
            return None
        segments = 2.0 * stretch.samples / n - 1.0
        weight = coherence[kept] / np.maximum(1.0 - coherence[kept], 1e-3) * segments
        # noise on either side: the geometric mean of both regressions has no bias where they are alike
        gain = np.sqrt(seen[kept] / own[kept]) * np.sign(np.real(both[kept]))
        return cls(2.0 * np.pi * f[kept], both[kept], gain, coherence[kept], weight)


def _wrong_way(stretch: Segment, name: str, against: str, tell: str) -> Finding:
    text = f"{name} has the other sign than {against} {tell}: a sensor is mounted the wrong way round"
    return Finding("sign", stretch.file, name, -1.0, "1", text, serious=True)


def _late(stretch: Segment, relation: _Relation, seen: _Transfer) -> Finding | None:
    """A delay [s] that is clear of its standard error, from the slope of the phase."""
    phase = np.unwrap(np.angle(seen.cross))
    delay = -float(np.sum(seen.weight * seen.w * phase) / np.sum(seen.weight * seen.w * seen.w))
    scatter = float(1.0 / np.sqrt(np.sum(seen.weight * seen.w * seen.w)))
    if abs(delay) <= max(CLOCK, FAULT * scatter):
        return None
    name, against, when = relation.channel, ", ".join(relation.others), "late" if delay > 0 else "early"
    text = f"{name} comes {1e3 * abs(delay):.1f} ms too {when} against {against}: two clocks, or a filter"
    return Finding("clock", stretch.file, name, delay, "s", text, serious=True)


def _amplified(stretch: Segment, relation: _Relation, seen: _Transfer) -> Finding | None:
    """A gain other than 1 that is clear of its standard error, where the two are most coherent."""
    strong = seen.coherence > STRONG
    if strong.sum() < FEWEST:
        return None
    size = float(np.average(np.abs(seen.gain[strong]), weights=seen.weight[strong]))
    spread = float(np.std(seen.gain[strong]) / np.sqrt(strong.sum()))
    if abs(size - 1.0) <= max(GAIN, FAULT * spread):
        return None
    name, against = relation.channel, ", ".join(relation.others)
    text = f"{name} is {size:.2f} times what {against} tell: check its gain and unit"
    return Finding("gain", stretch.file, name, size, "1", text, serious=abs(np.log(size)) > GROSS)
