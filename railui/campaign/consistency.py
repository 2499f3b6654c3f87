"""Kinematic consistency of channels: sign, delay and gain.

Whatever the parameters of the bogie, its measured motions satisfy

    y_i = e_i + y_wi + r phi_wi,    d_1'' = y_1'' - y'' - a psi'',    d_2'' = y_2'' - y'' + a psi''
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.dataset import Segment
from railui.campaign.finding import Finding
from railui.dsp.spectra import csd, welch

SPECTRUM_SECONDS = 2.56  # window of the spectra
BAND = (1.0, 12.0)  # Hz in which motions are compared
MIN_COHERENCE = 0.5  # at a frequency that is used
MIN_COHERENCE_OF_GAIN = 0.9  # at a frequency that is used for the gain
MIN_FREQUENCIES = 4  # with that coherence
MIN_RELATIVE_GAIN_ERROR = 0.08
MIN_DELAY = 0.004  # s
MIN_LOG_GAIN_OF_SERIOUS = 0.3  # from which no model fits the channel
MIN_STANDARD_ERRORS = 4.0  # of a reported delay or gain
MIN_COHERENCE_GAIN_OF_FLIP = 0.2  # by which the mean coherence is higher with the opposite sign


@dataclass(frozen=True, eq=False)
class _Relation:
    """A measured channel and its prediction from other channels, both as accelerations [n].

    flipped: the prediction if the first of the others were mounted with the opposite sign.
    """

    channel: str
    others: tuple[str, ...]
    measured: FloatArray
    predicted: FloatArray
    flipped: FloatArray | None = None


def _second_derivative(x: FloatArray, dt: float) -> FloatArray:
    """Second derivative [n] by central differences."""
    return np.gradient(np.gradient(x, dt), dt)


def _relations(segment: Segment, values: Mapping[str, float]) -> list[_Relation]:
    """List the relations between the channels that were measured."""
    columns = segment.columns
    r = values["vehicle.geometry.rolling_radius"]
    rails = columns["yw"] + r * columns.get("phiw", np.zeros_like(columns["yw"]))
    relations = _track_relations(segment, rails, 2.0 * values["vehicle.geometry.half_wheelbase"])
    return relations + _frame_relations(segment, values["vehicle.geometry.half_wheelbase"])


def _track_relations(segment: Segment, rails: FloatArray, wheelbase: float) -> list[_Relation]:
    """Predict the acceleration of each wheelset from its position on the track: y_i = e_i + y_wi + r phi_wi."""
    c, dt = segment.columns, segment.dt
    relations = []
    for i, distance_behind in ((1, 0.0), (2, wheelbase)):
        e, ay = f"e{i}", f"ay{i}"
        if e in c and ay in c:
            rail = np.interp(c["s"] - distance_behind, c["s"], rails)
            predicted, flipped = _second_derivative(c[e] + rail, dt), _second_derivative(rail - c[e], dt)
            relations.append(_Relation(ay, (e,), c[ay], predicted, flipped))
    return relations


def _frame_relations(segment: Segment, half_wheelbase: float) -> list[_Relation]:
    """Predict the deflection of each primary suspension: d_i'' = y_i'' - y'' -+ a psi''."""
    c, dt = segment.columns, segment.dt
    if "ayf" not in c or "rf" not in c:
        return []
    relations = []
    for i, sign in ((1, -1.0), (2, 1.0)):
        d, ay = f"d{i}", f"ay{i}"
        if d in c and ay in c:
            predicted = c[ay] - c["ayf"] + sign * half_wheelbase * np.gradient(c["rf"], dt)
            relations.append(_Relation(d, (ay, "ayf", "rf"), _second_derivative(c[d], dt), predicted))
    return relations


def kinematic_checks(segment: Segment, values: Mapping[str, float]) -> list[Finding]:
    """Check sign, delay and gain of every channel that other channels predict.

    Parameters
    ----------
    segment
        A segment of a run of a bogie.
    values
        Parameters of the bogie.
    """
    faults: list[tuple[_Relation, Finding]] = []
    consistent: set[str] = set()
    for relation in _relations(segment, values):
        finding = _check_relation(segment, relation)
        if finding is None:
            consistent |= {relation.channel, *relation.others}
        else:
            faults.append((relation, finding))
    return [
        replace(finding, channel=_likely_culprit(relation, finding, consistent, faults)) for relation, finding in faults
    ]


def _likely_culprit(
    relation: _Relation, finding: Finding, consistent: set[str], faults: list[tuple[_Relation, Finding]]
) -> str | None:
    """Choose the channel in most faulty relations among those that agree with no other channel."""
    if finding.channel != relation.channel:
        return finding.channel
    suspects = [c for c in (relation.channel, *relation.others) if c not in consistent] or [relation.channel]
    counts = {c: sum(c in (r.channel, *r.others) for r, _ in faults) for c in suspects}
    return max(suspects, key=lambda c: counts[c])


def _check_relation(segment: Segment, relation: _Relation) -> Finding | None:
    """Sign, delay or gain fault of a channel; None if it agrees with its prediction or nothing can be decided."""
    length = min(round(SPECTRUM_SECONDS / segment.dt), segment.samples // 4)
    if relation.flipped is not None:
        flipped = _mean_coherence(relation.flipped, relation.measured, segment.dt, length)
        as_is = _mean_coherence(relation.predicted, relation.measured, segment.dt, length)
        if flipped > as_is + MIN_COHERENCE_GAIN_OF_FLIP:
            return _wrong_sign(segment, relation.others[0], relation.channel)
    transfer = _Transfer.estimate(segment, relation, length)
    if transfer is None:
        return None
    if float(np.average(np.real(transfer.cross) < 0, weights=transfer.weight)) > 0.5:
        return _wrong_sign(segment, relation.channel, ", ".join(relation.others))
    return _delay(segment, relation, transfer) or _wrong_gain(segment, relation, transfer)


def _mean_coherence(x: FloatArray, y: FloatArray, dt: float, length: int) -> float:
    """Mean coherence of two signals in the band, from windows of so many samples."""
    f, cross = csd(x, y, 1.0 / dt, length)
    coherence = np.abs(cross) ** 2 / (welch(x, 1.0 / dt, length)[1] * welch(y, 1.0 / dt, length)[1])
    return float(np.mean(coherence[(f >= BAND[0]) & (f <= BAND[1])]))


@dataclass(frozen=True, eq=False)
class _Transfer:
    """Transfer function from the prediction to the channel, at the frequencies [n] of the band where both are coherent.

    w [rad/s], cross spectrum, gain (with the sign of the cross spectrum's real part), coherence; weight: precision of
    the phase.
    """

    w: FloatArray
    cross: ComplexArray
    gain: FloatArray
    coherence: FloatArray
    weight: FloatArray

    @classmethod
    def estimate(cls, segment: Segment, relation: _Relation, length: int) -> _Transfer | None:
        """Estimate from windows of so many samples; None if too few frequencies are coherent."""
        rate = 1.0 / segment.dt
        f, cross = csd(relation.predicted, relation.measured, rate, length)
        predicted = welch(relation.predicted, rate, length)[1]
        measured = welch(relation.measured, rate, length)[1]
        coherence = np.abs(cross) ** 2 / np.maximum(predicted * measured, 1e-300)
        used = (f >= BAND[0]) & (f <= BAND[1]) & (coherence > MIN_COHERENCE)
        if used.sum() < MIN_FREQUENCIES:
            return None
        averages = 2.0 * segment.samples / length - 1.0
        weight = coherence[used] / np.maximum(1.0 - coherence[used], 1e-3) * averages
        # noise on either side: the geometric mean of both regressions is unbiased if the two are alike
        gain = np.sqrt(measured[used] / predicted[used]) * np.sign(np.real(cross[used]))
        return cls(2.0 * np.pi * f[used], cross[used], gain, coherence[used], weight)


def _wrong_sign(segment: Segment, name: str, others: str) -> Finding:
    text = (
        f"{name} has the opposite sign of what {others} predict{'' if ',' in others else 's'}: check how it is mounted"
    )
    return Finding("sign", segment.file, name, -1.0, "1", text, serious=True)


def _delay(segment: Segment, relation: _Relation, transfer: _Transfer) -> Finding | None:
    """Significant delay [s], from the slope of the phase."""
    phase = np.unwrap(np.angle(transfer.cross))
    precision = np.sum(transfer.weight * transfer.w * transfer.w)
    delay = -float(np.sum(transfer.weight * transfer.w * phase) / precision)
    standard_error = float(1.0 / np.sqrt(precision))
    if abs(delay) <= max(MIN_DELAY, MIN_STANDARD_ERRORS * standard_error):
        return None
    others, late = ", ".join(relation.others), "late" if delay > 0 else "early"
    text = (
        f"{relation.channel} is {1e3 * abs(delay):.1f} ms {late} against {others}: "
        "check whether two clocks or a filter cause it"
    )
    return Finding("clock", segment.file, relation.channel, delay, "s", text, serious=True)


def _wrong_gain(segment: Segment, relation: _Relation, transfer: _Transfer) -> Finding | None:
    """Gain that differs significantly from 1, at the frequencies of highest coherence."""
    used = transfer.coherence > MIN_COHERENCE_OF_GAIN
    if used.sum() < MIN_FREQUENCIES:
        return None
    gain = float(np.average(np.abs(transfer.gain[used]), weights=transfer.weight[used]))
    standard_error = float(np.std(transfer.gain[used]) / np.sqrt(used.sum()))
    if abs(gain - 1.0) <= max(MIN_RELATIVE_GAIN_ERROR, MIN_STANDARD_ERRORS * standard_error):
        return None
    others = ", ".join(relation.others)
    text = f"{relation.channel} is {gain:.2f} times its value predicted from {others}: check its gain and unit"
    is_serious = bool(abs(np.log(gain)) > MIN_LOG_GAIN_OF_SERIOUS)
    return Finding("gain", segment.file, relation.channel, gain, "1", text, serious=is_serious)
