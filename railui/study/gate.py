"""The gate before an adjustment: what is wrong with the data themselves, each with its channel and a number.

Clock, gain and sign are held against what the motions owe one another whatever the vehicle is made of:
y_i = e_i + y_wi + r phi_wi, and d_1'' = y_1'' - y'' - a psi'', d_2'' = y_2'' - y'' + a psi''. Data are never altered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from railui.study.measured import COMPARED, Measurement, Stretch

Floats = NDArray[np.float64]
SEGMENT = 2.56  # s of a segment of the spectra
BAND = (1.0, 12.0)  # Hz in which motions are held against each other
CLEAR = 0.5  # coherence from which a relation tells something
GAIN, CLOCK = 0.08, 0.004  # least fault that is told: relative, s
FAULT = 4.0  # standard errors that it must exceed
CLIPPED = 3  # samples in a row at the extreme
STUCK = 1.0  # s at one value
WINDOW, STEP, RISEN = 100.0, 10.0, 2.0  # m, m, times the median rms: a hunting stretch
HUNTING = (0.8, 8.0)  # Hz


@dataclass(frozen=True)
class Finding:
    """One thing about the data: check, run, channel, number with unit, and words; from and to [s] where it has a place.

    `serious`: the data are wrong there, and no model will fit them.
    """

    check: str
    file: str
    channel: str | None
    value: float
    unit: str
    text: str
    serious: bool = False
    start: float | None = None
    end: float | None = None


def gate(measurement: Measurement) -> list[Finding]:
    """All findings of a measurement, the serious ones first."""
    found: list[Finding] = []
    for entry, run in zip(measurement.campaign.runs, measurement.runs, strict=True):
        found += _gaps(entry.name, run.counts)
        for name in (*run.responses, *run.coach):
            found += _stuck(entry.name, name, run.columns[name], run.columns["t"], run.rate)
    for stretch in measurement.stretches:
        found += [f for c in stretch.channels for f in _clipping(stretch, c)]
        if stretch.kind == "bogie":
            found += relations(stretch, measurement.campaign.design.values)
            found += ceilings(stretch, measurement.campaign.design.values)
            found += hunting(stretch)
    return sorted(found, key=lambda f: not f.serious)


def _gaps(file: str, counts: Mapping[str, int]) -> list[Finding]:
    if not counts.get("gaps") and not counts.get("nan_rows"):
        return []
    share = 100.0 * counts["unused_rows"] / max(counts["rows"], 1)
    text = f"{counts['gaps']} gaps, {counts['nan_rows']} rows with empty cells: {share:.1f} % of the rows are not used"
    return [Finding("gaps", file, None, counts["gaps"], "1", text)]


def _stuck(file: str, name: str, x: Floats, t: Floats, rate: float) -> list[Finding]:
    edges = np.concatenate(([0], np.flatnonzero(np.diff(x) != 0) + 1, [len(x)]))
    longest = int(np.argmax(np.diff(edges)))
    seconds = (edges[longest + 1] - edges[longest]) / rate
    if seconds < STUCK or not np.any(x):
        return []
    start = float(t[edges[longest]])
    text = f"{name} holds one value for {seconds:.1f} s from {start:.1f} s: not used there"
    return [Finding("stuck", file, name, float(seconds), "s", text, False, start, start + float(seconds))]


def _clipping(stretch: Stretch, name: str) -> list[Finding]:
    """Samples in a row at the very extreme of a channel."""
    x = stretch.columns[name]
    count = 0
    for extreme in (x.max(), x.min()):
        at = np.concatenate(([0], (x == extreme).astype(int), [0]))
        starts, ends = np.flatnonzero(np.diff(at) == 1), np.flatnonzero(np.diff(at) == -1)
        long = (ends - starts)[ends - starts >= CLIPPED]
        count += int(long.sum())
    if not count:
        return []
    share = 100.0 * count / len(x)
    text = f"{name} is clipped: {count} samples ({share:.2f} %) stand in a row at its extreme"
    return [Finding("clipping", stretch.file, name, share / 100.0, "1", text, serious=share > 0.1)]


@dataclass(frozen=True)
class _Relation:
    """One channel and what it must equal, both as accelerations [n]; `others` are the channels in it.

    flipped: what it would have to equal were the first of the others mounted the wrong way round.
    """

    channel: str
    others: tuple[str, ...]
    measured: Floats
    owed: Floats
    flipped: Floats | None = None


def _twice(x: Floats, dt: float) -> Floats:
    return np.gradient(np.gradient(x, dt), dt)


def _relations(stretch: Stretch, values: Mapping[str, float]) -> list[_Relation]:
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


def relations(stretch: Stretch, values: Mapping[str, float]) -> list[Finding]:
    """Clock, gain and sign of every channel that others can be held against."""
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
        out.append(
            Finding(finding.check, finding.file, worst, finding.value, finding.unit, finding.text, finding.serious)
        )
    return out


def _coherent(x: Floats, y: Floats, dt: float, n: int) -> float:
    """Mean coherence of two signals in the band."""
    f, coherence = signal.coherence(x, y, 1.0 / dt, nperseg=n)
    return float(np.mean(coherence[(f >= BAND[0]) & (f <= BAND[1])]))


def _held(stretch: Stretch, relation: _Relation) -> Finding | None:
    """Sign, gain and delay of a channel against what it must equal, where the two are coherent."""
    n = min(round(SEGMENT / stretch.dt), stretch.samples // 4)
    if relation.flipped is not None:
        turned, so = (_coherent(x, relation.measured, stretch.dt, n) for x in (relation.flipped, relation.owed))
        if turned > so + 0.2:
            e = relation.others[0]
            text = f"{e} has the other sign than {relation.channel} tells: a sensor is mounted the wrong way round"
            return Finding("sign", stretch.file, e, -1.0, "1", text, serious=True)
    f, cross = signal.csd(relation.owed, relation.measured, 1.0 / stretch.dt, nperseg=n)
    _, own = signal.welch(relation.owed, 1.0 / stretch.dt, nperseg=n)
    _, seen = signal.welch(relation.measured, 1.0 / stretch.dt, nperseg=n)
    coherence = np.abs(cross) ** 2 / np.maximum(own * seen, 1e-300)
    kept = (f >= BAND[0]) & (f <= BAND[1]) & (coherence > CLEAR)
    if kept.sum() < 4:
        return None
    segments = 2.0 * stretch.samples / n - 1.0
    weight = coherence[kept] / np.maximum(1.0 - coherence[kept], 1e-3) * segments
    # noise on either side: the geometric mean of both regressions has no bias where they are alike
    gain = np.sqrt(seen[kept] / own[kept]) * np.sign(np.real(cross[kept]))
    against = ", ".join(relation.others)
    file, name = stretch.file, relation.channel
    flipped = float(np.average(np.real(cross[kept]) < 0, weights=weight))
    if flipped > 0.5:
        text = f"{name} has the other sign than {against} tell: a sensor is mounted the wrong way round"
        return Finding("sign", file, name, -1.0, "1", text, serious=True)
    phase = np.unwrap(np.angle(cross[kept]))
    w = 2.0 * np.pi * f[kept]
    delay = -float(np.sum(weight * w * phase) / np.sum(weight * w * w))
    scatter = float(1.0 / np.sqrt(np.sum(weight * w * w)))
    if abs(delay) > max(CLOCK, FAULT * scatter):
        when = "late" if delay > 0 else "early"
        text = f"{name} comes {1e3 * abs(delay):.1f} ms too {when} against {against}: two clocks, or a filter"
        return Finding("clock", file, name, delay, "s", text, serious=True)
    strong = coherence[kept] > 0.9
    if strong.sum() < 4:
        return None
    size = float(np.average(np.abs(gain[strong]), weights=weight[strong]))
    spread = float(np.std(gain[strong]) / np.sqrt(strong.sum()))
    if abs(size - 1.0) > max(GAIN, FAULT * spread):
        text = f"{name} is {size:.2f} times what {against} tell: check its gain and unit"
        return Finding("gain", file, name, size, "1", text, serious=abs(np.log(size)) > 0.3)
    return None


def ceilings(stretch: Stretch, values: Mapping[str, float]) -> list[Finding]:
    """What of every channel a linear vehicle explains from the track under both wheelsets: multiple coherence.

    value: the nrmse that remains; nonlinear effects, unmeasured forces, noise and a speed that varies all add to it.
    """
    c, behind = stretch.columns, 2.0 * values["vehicle.geometry.half_wheelbase"]
    inputs = [c[q] for q in ("yw", "phiw") if np.any(c.get(q, np.zeros(1)))]
    inputs += [np.interp(c["s"] - behind, c["s"], x) for x in inputs]
    n = min(round(2 * SEGMENT / stretch.dt), stretch.samples // 10)
    out = []
    f, x = _spectra(inputs, stretch.dt, n)
    kept = (f >= 0.5) & (f <= BAND[1])
    segments = x.shape[1]
    if segments < 4 * len(inputs):
        return []
    sxx = np.einsum("isf,jsf->fij", x.conj(), x)[kept]
    for name in stretch.channels:
        if name not in COMPARED:
            continue
        _, y = _spectra([c[name]], stretch.dt, n)
        sxy = np.einsum("isf,sf->fi", x.conj(), y[0])[kept]
        syy = np.sum(np.abs(y[0]) ** 2, axis=0)[kept]
        explained = np.real(np.einsum("fi,fi->f", sxy.conj(), np.linalg.solve(sxx, sxy[..., None])[..., 0]))
        free = np.clip((syy - explained) * segments / max(segments - len(inputs), 1), 0.0, None)
        rest = float(np.sqrt(min(free.sum() / syy.sum(), 1.0)))
        text = f"{name}: {rest:.2f} of it is not coherent with the track (nonlinear, unmeasured, noise, changing speed)"
        out.append(Finding("ceiling", stretch.file, name, rest, "1", text))
    return out


def _spectra(columns: Sequence[Floats], dt: float, n: int) -> tuple[Floats, NDArray[np.complex128]]:
    """Windowed transforms [column, segment, frequency] of half-overlapping segments."""
    window = signal.windows.hann(n, sym=False)
    starts = range(0, len(columns[0]) - n + 1, n // 2)
    parts = [[np.fft.rfft(signal.detrend(x[k : k + n]) * window) for k in starts] for x in columns]
    return np.asarray(np.fft.rfftfreq(n, dt), dtype=np.float64), np.array(parts)


def hunting(stretch: Stretch) -> list[Finding]:
    """Stretches where a wheelset swings much more than along the rest, with frequency and wavelength."""
    name = next((c for c in ("ay1", "ay2") if c in stretch.columns), None)
    if name is None:
        return []
    s, t = stretch.columns["s"], stretch.columns["t"]
    sos = signal.butter(2, HUNTING, "bandpass", fs=1.0 / stretch.dt, output="sos")
    x = signal.sosfiltfilt(sos, stretch.columns[name])
    starts = np.arange(s[0], s[-1] - WINDOW, STEP)
    if len(starts) < 10:
        return []
    total = np.concatenate(([0.0], np.cumsum(x * x)))
    first, last = np.searchsorted(s, starts), np.searchsorted(s, starts + WINDOW)
    rms = np.sqrt((total[last] - total[first]) / np.maximum(last - first, 1))
    risen = np.concatenate(([0], (rms > RISEN * np.median(rms)).astype(int), [0]))
    out = []
    for k, j in zip(np.flatnonzero(np.diff(risen) == 1), np.flatnonzero(np.diff(risen) == -1) - 1, strict=True):
        a, b = int(first[k]), int(last[j]) - 1
        f, density = signal.periodogram(x[a:b], 1.0 / stretch.dt)
        frequency = float(f[np.argmax(density)])
        v = float(stretch.columns["v"][a:b].mean())
        times = float(rms[k : j + 1].max() / np.median(rms))
        text = (
            f"hunting from {s[a]:.0f} to {s[b]:.0f} m: {name} swings {times:.1f} times its median "
            f"at {frequency:.2f} Hz, wavelength {v / max(frequency, 1e-9):.1f} m"
        )
        out.append(Finding("hunting", stretch.file, name, frequency, "Hz", text, False, float(t[a]), float(t[b])))
    return out
