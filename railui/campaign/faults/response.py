"""Faults by the response of the vehicle to the track, where no kinematic relation determines them.

The numbers of the vehicle are uncertain: a fault is found where its correction makes the channels agree with one of
many vehicles about the nominal model better than any of these vehicles agrees with the channels as they are. Gains
and delays of usual sensors, which an inaccurate vehicle leaves as well, are free in both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.faults.families import ACCELERATIONS, TRACK, groups_of, unit_gains
from railui.campaign.faults.hypotheses import G, Hypothesis
from railui.campaign.faults.merge import is_serious
from railui.campaign.faults.response_spectra import ResponseSpectra
from railui.campaign.faults.spectra import ROLL
from railui.campaign.settings.faults import FaultSettings
from railui.parallel import map_threads

GAINS = np.geomspace(0.8, 1.25, 5, dtype=np.float64)  # of usual sensors and inaccurate vehicles
LAGS = 4e-3 * np.arange(-3.0, 4.0)  # s, the same
WRONG_GAINS = np.array([*(1.0 / x for x in np.geomspace(2.0, 8.0, 9)), *np.geomspace(2.0, 8.0, 9)])
DELAYS = 4e-3 * np.arange(-75.0, 76.0)  # s
OFFSETS = 0.05 * np.arange(-120.0, 121.0)  # m
RATES = np.outer([-1.0, 1.0], np.geomspace(1e-4, 4e-3, 14, dtype=np.float64)).ravel()
CLOCK_LAGS = 8e-3 * np.arange(-12.0, 13.0)  # s at the start
CLOCK_LAG_STEPS = 2e-3 * np.arange(-4.0, 5.0)  # s
REFINEMENTS = {"gain": 0.2, "clock": 0.4, "delay": 4e-3, "offset": 0.05}  # half the step of a grid or more
MIN_SHARE = 1e-9
LOG_BLOCK = 16  # factors of one logarithm; at MIN_SHARE their product is 1e-144
SAME_GAIN = 0.05
CLOCK_VEHICLES = 8
ALL = slice(None)
IntArray = NDArray[np.intp]


@dataclass(frozen=True)
class ResponseFault:
    """A fault with its evidence per independent sample, and others that explain the data as well."""

    hypothesis: Hypothesis
    share: float
    alternatives: tuple[Hypothesis, ...] = ()


class ResponseConsistency:
    """Agreement of the channels of all runs with vehicles about the nominal model, under faults.

    The misfit of a fault and a vehicle is that of `Consistency`, n log(power of the difference / sum of the powers),
    summed over channels, frequencies and runs. That of a fault is the least over the vehicles.
    """

    def __init__(self, runs: Sequence[ResponseSpectra], names: Sequence[str], jobs: int | None = 1) -> None:
        stable = np.all([np.isfinite(r.level).all(axis=(1, 2, 3)) for r in runs], axis=0)
        self.names = list(names)
        self.jobs = jobs
        self.runs = [replace(r, alignment=r.alignment[stable], level=r.level[stable]) for r in runs]
        self.samples = sum(0.5 * r.measured.size for r in runs)
        self.sound = [self._channel(c) for c in range(len(names))] if np.any(stable) else []

    @property
    def misfit(self) -> float:
        """Misfit of the channels as they are."""
        return self._with({})

    def scores(self) -> Iterator[tuple[Hypothesis, float]]:
        """Yield faults with their misfits."""
        parts: list[Callable[[], Iterator[tuple[Hypothesis, float]]]] = [
            *(partial(self._of_channel, c, name) for c, name in enumerate(self.names)),
            self._of_pairs_and_track,
            self._of_lags,
            self._of_clocks,
        ]
        for found in map_threads(lambda part: list(part()), parts, self.jobs):
            yield from found

    def _of_pairs_and_track(self) -> Iterator[tuple[Hypothesis, float]]:
        """Yield exchanged accelerations, and wrong signs of the track."""
        for a, b in combinations([c for c, n in enumerate(self.names) if n in ACCELERATIONS], 2):
            pair = {a: self._channel(a, source=b), b: self._channel(b, source=a)}
            yield Hypothesis("exchanged", (self.names[a], self.names[b])), self._with(pair)
        for track, signs in (("yw",), (-1.0, 1.0)), (("phiw",), (1.0, -1.0)), (TRACK, (-1.0, -1.0)):
            misfits = {c: self._channel(c, signs=signs) for c in range(len(self.names))}
            yield Hypothesis("sign", track, -1.0), self._with(misfits)

    def unit_scores(self) -> Iterator[tuple[Hypothesis, float]]:
        """Yield wrong units of single channels with their misfits."""
        for c, name in enumerate(self.names):
            yield from self._of_units(c, name)

    def _of_units(self, c: int, name: str) -> Iterator[tuple[Hypothesis, float]]:
        for gain in _distinct(unit_gains(name)):
            yield Hypothesis("unit", (name,), gain), self._with({c: self._channel(c, gains=gain * GAINS)})

    def _of_channel(self, c: int, name: str) -> Iterator[tuple[Hypothesis, float]]:
        yield Hypothesis("sign", (name,), -1.0), self._with({c: self._channel(c, gains=-GAINS)})
        yield from self._of_units(c, name)
        tables = self._tables(c, WRONG_GAINS, LAGS).min(axis=2)
        misfits = [self._with({c: tables[:, k]}) for k in range(len(WRONG_GAINS))]
        best = int(np.argmin(misfits))
        yield Hypothesis("gain", (name,), float(WRONG_GAINS[best])), misfits[best]
        for g in (G, -G) if name in ROLL else ():
            yield Hypothesis("gravity", (name,), g), self._with({c: self._channel(c, gravity=g)})

    def _of_lags(self) -> Iterator[tuple[Hypothesis, float]]:
        """Yield delays of channels and loggers, and an offset of the track: one lag of all its channels."""
        tables = [self._tables(c, GAINS, DELAYS).min(axis=1) for c in range(len(self.names))]
        for group in groups_of(self.names):
            delay, misfit = self._best_lag(group, tables, DELAYS)
            yield Hypothesis("delay", group, delay), misfit
        tables = [self._tables(c, GAINS, OFFSETS, is_distance=True).min(axis=1) for c in range(len(self.names))]
        offset, misfit = self._best_lag(self.names, tables, OFFSETS)
        yield Hypothesis("offset", TRACK, offset), misfit

    def _of_clocks(self) -> Iterator[tuple[Hypothesis, float]]:
        """Yield drifting clocks of loggers, judged by the vehicles that agree best with the channels as they are."""
        best = np.argsort(np.sum(self.sound, axis=0))[:CLOCK_VEHICLES]
        groups = [g for g in dict.fromkeys([tuple(self.names), *groups_of(self.names)]) if len(g) > 1]
        scores: dict[tuple[str, ...], list[tuple[float, float, float]]] = {}
        for rate in RATES:
            tables = [
                self._tables(c, GAINS, CLOCK_LAGS, rate=rate, vehicles=best).min(axis=1) for c in range(len(self.names))
            ]
            for group in groups:
                lag, misfit = self._best_lag(group, tables, CLOCK_LAGS, best)
                scores.setdefault(group, []).append((misfit, float(rate), lag))
        for group, tried in scores.items():
            misfit, rate, lag = min(tried)
            yield Hypothesis("clock", group, rate, lag), misfit

    def _best_lag(
        self, group: Sequence[str], tables: Sequence[FloatArray], lags: FloatArray, vehicles: slice | IntArray = ALL
    ) -> tuple[float, float]:
        """Best common lag of channels, from misfits [vehicle, lag], and its misfit."""
        rows = [
            t if n in group else s[vehicles][:, None] for n, t, s in zip(self.names, tables, self.sound, strict=True)
        ]
        misfits = np.sum(np.broadcast_arrays(*rows), axis=0).min(axis=0)
        best = int(np.argmin(misfits))
        return float(lags[best]), float(misfits[best])

    def refined(self, h: Hypothesis) -> Hypothesis:
        """Return a fault with its value between the points of its grid."""
        if h.kind not in REFINEMENTS:
            return h
        steps = REFINEMENTS[h.kind] * np.linspace(-1.0, 1.0, 21)
        values = h.value * (1.0 + steps) if h.kind in ("gain", "clock") else h.value + steps
        delays = h.delay + CLOCK_LAG_STEPS if h.kind == "clock" else [h.delay]
        return min((replace(h, value=float(x), delay=float(d)) for x in values for d in delays), key=self._misfit_of)

    def _misfit_of(self, h: Hypothesis) -> float:
        """Misfit of a gain, delay, offset or drifting clock."""
        group = self.names if h.kind == "offset" else h.channels
        gains, lags, options = GAINS, np.array([h.value]), {"is_distance": h.kind == "offset"}
        if h.kind == "gain":
            gains, lags, options = np.array([h.value]), LAGS, {}
        elif h.kind == "clock":
            lags, options = np.array([h.delay]), {"rate": h.value}  # type: ignore[dict-item]
        changed = {
            c: self._tables(c, gains, lags, **options).min(axis=(1, 2))  # type: ignore[arg-type]
            for c, name in enumerate(self.names)
            if name in group
        }
        return self._with(changed)

    def _with(self, changed: Mapping[int, FloatArray]) -> float:
        """Misfit with those [vehicle] of some channels replaced."""
        return float(np.sum([changed.get(c, x) for c, x in enumerate(self.sound)], axis=0).min())

    def _channel(self, c: int, gains: FloatArray = GAINS, **options: Any) -> FloatArray:
        """Misfit [vehicle] of a channel at the best usual gain and lag, the same in all runs."""
        return np.asarray(self._tables(c, gains, LAGS, **options).min(axis=(1, 2)))

    def _tables(
        self,
        c: int,
        gains: FloatArray,
        lags: FloatArray,
        *,
        source: int | None = None,
        gravity: float = 0.0,
        signs: tuple[float, float] = (1.0, 1.0),
        rate: float = 0.0,
        is_distance: bool = False,
        vehicles: slice | IntArray = ALL,
    ) -> FloatArray:
        """Misfit [vehicle, gain, lag] of a channel in all runs.

        source: index of the column in which it is recorded. gravity: [m/s^2] that it feels through roll. signs: of
        alignment and cross-level. rate: of its clock less 1. is_distance: lags are offsets of the track [m].
        """
        total: FloatArray = np.zeros(())
        for run in self.runs:
            measured = run.measured[c if source is None else source] - gravity * run.roll[c]
            measured = measured * np.exp(2j * np.pi * rate * run.time[:, None] * run.f)
            simulated = signs[0] * run.alignment[vehicles, c] + signs[1] * run.level[vehicles, c]
            at = -lags / run.speed if is_distance else lags
            total = total + _misfits(measured, simulated, run.f, gains, at)
        return total


def _distinct(gains: Sequence[float]) -> list[float]:
    """Leave out a power of ten next to the factor of a named unit, which an inaccurate vehicle does not separate.

    >>> _distinct([0.1, 10.0, 9.80665])
    [0.1, 9.80665]
    """
    return [g for i, g in enumerate(gains) if not any(abs(np.log(g / x)) < SAME_GAIN for x in gains[i + 1 :])]


def _misfits(
    measured: ComplexArray, simulated: ComplexArray, f: FloatArray, gains: FloatArray, lags: FloatArray
) -> FloatArray:
    """Misfit [vehicle, gain, lag] of a channel [window, frequency] to its simulations [vehicle, window, frequency].

    The channel is recorded with a gain, and late by a lag [s].
    """
    power = np.mean(np.abs(measured) ** 2, axis=0) / gains[:, None] ** 2
    powers = np.mean(np.abs(simulated) ** 2, axis=1)[:, None] + power
    cross = np.mean(simulated.conj() * measured, axis=1)
    common = np.real(cross[:, None] * np.exp(2j * np.pi * lags[:, None] * f))
    scale = 2.0 / (gains[:, None] * powers)
    ratio = np.maximum(1.0 - common[:, None] * scale[:, :, None], MIN_SHARE)
    products = np.multiply.reduceat(ratio, np.arange(0, len(f), LOG_BLOCK), axis=-1)
    return np.asarray(0.5 * len(measured) * np.log(products).sum(axis=-1))


def find_unit_of_run(
    runs: Sequence[ResponseSpectra], names: Sequence[str], settings: FaultSettings
) -> tuple[int, ResponseFault] | None:
    """Find the unit of a channel that is wrong in some runs only, and the first of these; None where none is."""
    consistencies = [ResponseConsistency([run], names) for run in runs]
    found = [find_response_fault(c, settings, c.unit_scores() if c.sound else ()) for c in consistencies]
    faulty = [(i, fault) for i, fault in enumerate(found) if fault is not None]
    return faulty[0] if 0 < len(faulty) < len(runs) else None


def find_response_fault(
    consistency: ResponseConsistency, settings: FaultSettings, scores: Iterable[tuple[Hypothesis, float]] | None = None
) -> ResponseFault | None:
    """Find the fault with most evidence; None where no fault has enough.

    scores: faults with their misfits; all by default.
    """
    if not consistency.sound:
        return None
    base = consistency.misfit
    tried = consistency.scores() if scores is None else scores
    shares = [((base - misfit) / consistency.samples, h) for h, misfit in tried]
    evident = [(x, h) for x, h in shares if x > _needed_share(h, settings) and _is_large(h, consistency, settings)]
    if not evident:
        return None
    most, first = max(evident, key=lambda e: e[0])
    wider = [e for e in evident if _includes(e[1], first) and e[0] > settings.wider_evidence_share * most]
    share, best = max(wider, key=lambda e: len(e[1].channels))
    tied = [h for x, h in evident if x > (1.0 - settings.tied_evidence_share) * most]
    ties = [h for h in tied if not _includes(best, h)]
    return ResponseFault(consistency.refined(best), share, tuple(ties))


def _includes(h: Hypothesis, other: Hypothesis) -> bool:
    """True if a fault of several channels contains one of some of them."""
    return h.kind == other.kind and set(h.channels) >= set(other.channels)


def _needed_share(h: Hypothesis, settings: FaultSettings) -> float:
    is_gravity = h.kind == "gravity"
    return settings.min_gravity_response_share if is_gravity else settings.min_response_share


def _is_large(h: Hypothesis, consistency: ResponseConsistency, settings: FaultSettings) -> bool:
    """True for a fault larger than the lags that an inaccurate vehicle leaves, and serious."""
    if h.kind == "clock":
        return abs(h.value) * max(float(np.ptp(r.time)) for r in consistency.runs) > settings.response_drift
    if h.kind == "offset":
        return abs(h.value) > settings.response_offset
    return is_serious(h, settings) and not (h.kind == "delay" and abs(h.value) < settings.response_delay)
