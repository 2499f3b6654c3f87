"""Hypotheses about faults of the columns, as operators on the relations, and how consistent each makes the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.corrections.correction import Correction, Corrections
from railui.campaign.faults.spectra import ROLL, RunSpectra

G = 9.80665  # m/s^2
RADIAN = 180.0 / np.pi


@dataclass(frozen=True)
class Hypothesis:
    """A fault of one channel or of a group of channels.

    Attributes
    ----------
    kind
        sign, unit, gain, delay, clock, offset, exchanged or gravity.
    channels
        Of an exchange: the first with the last, the second with the last but one.
    value
        Gain, delay [s], rate of the clock less 1, offset [m], gravity [m/s^2 per rad].
    delay
        Of a clock: delay [s] at the start of the run.
    """

    kind: str
    channels: tuple[str, ...]
    value: float = 0.0
    delay: float = 0.0

    def corrections(self, runs: tuple[str, ...] = ()) -> Corrections:
        """Return the corrections that undo the fault in some runs; in all without any."""
        if self.kind == "offset":
            return Corrections((), dict.fromkeys(runs or ("",), self.value))
        changes: dict[str, dict[str, object]] = {
            "sign": {"gain": -1.0},
            "unit": {"gain": self.value},
            "gain": {"gain": self.value},
            "delay": {"delay": self.value},
            "clock": {"clock_rate": 1.0 + self.value, "delay": self.delay},
            "gravity": {"gravity": self.value},
        }
        if self.kind == "exchanged":
            pairs = zip(self.channels[: len(self.channels) // 2], self.channels[::-1], strict=False)
            return Corrections(tuple(Correction(c, runs=runs, swap_with=other) for c, other in pairs))
        keys = changes[self.kind]
        return Corrections(tuple(Correction(c, runs=runs, **keys) for c in self.channels))  # type: ignore[arg-type]


def corrected_relations(
    spectra: RunSpectra, relations: ComplexArray, hypothesis: Hypothesis, speed: float, time: float = 0.0
) -> ComplexArray:
    """Return relations [frequency, relation, column] as they act on the recorded columns under a hypothesis."""
    h, a = hypothesis, relations.copy()
    columns = [i for c in h.channels for i in spectra.columns(c)]
    w = 2.0 * np.pi * spectra.f[:, None, None]
    if h.kind == "exchanged":
        a[..., columns] = a[..., columns[::-1]]
    elif h.kind == "gravity":
        for c in h.channels:
            a[..., spectra.names.index(ROLL[c])] -= h.value * a[..., spectra.names.index(c)]
    elif h.kind in ("sign", "unit", "gain"):
        a[..., columns] /= -1.0 if h.kind == "sign" else h.value
    else:
        lag = {"delay": h.value, "clock": h.delay + h.value * time, "offset": h.value / speed}[h.kind]
        a[..., columns] *= np.exp(1j * w * lag)
    return a


class Consistency:
    """Consistency of the columns of a run under hypotheses.

    The misfit of a hypothesis is the sum over all frequencies of n log(det R/det S), with n independent windows, R the
    covariance of the relations' residuals, S that of columns of the same power without any coherence. For Gaussian
    columns with unknown noise it is a negative log-likelihood; no gain of a column makes it small by itself.
    """

    def __init__(self, spectra: RunSpectra, rows: slice = slice(None)) -> None:
        self.spectra = spectra
        z = spectra.z[rows]
        self.windows = len(z)
        self.weight = 0.5 * self.windows  # Hann windows that overlap by half, neighbouring frequencies correlated
        self.cross = np.einsum("wfi,wfj->fij", z, z.conj()) / self.windows
        self.power = np.real(np.einsum("fii->fi", self.cross))
        self.speed = float(np.mean(spectra.speed))
        self.base = np.broadcast_to(
            spectra.relations.astype(complex), (len(spectra.f), *spectra.relations.shape)
        ).copy()

    def relations(self, hypotheses: Sequence[Hypothesis]) -> ComplexArray:
        """Return the relations under several faults at once; exchanged columns first, as in a correction."""
        a = self.base
        order = ("gravity", "delay", "clock", "offset", "gain", "unit", "sign", "exchanged")
        for h in sorted(hypotheses, key=lambda h: order.index(h.kind)):
            a = corrected_relations(self.spectra, a, h, self.speed, float(np.mean(self.spectra.time)))
        return a

    def misfit(self, relations: ComplexArray) -> FloatArray:
        """Misfit per frequency of relations [..., frequency, relation, column]."""
        conjugate = np.swapaxes(relations.conj(), -1, -2)
        residual = relations @ self.cross @ conjugate
        power = (relations * self.power[:, None, :]) @ conjugate
        return self.weight * (_log_det(residual) - _log_det(power))

    def worst_share(self, relations: ComplexArray) -> FloatArray:
        """Logarithm of the inconsistent share of power in the worst combination of relations [frequency]."""
        conjugate = np.swapaxes(relations.conj(), -1, -2)
        residual = relations @ self.cross @ conjugate
        power = (relations * self.power[:, None, :]) @ conjugate
        shares = np.real(np.linalg.eigvals(np.linalg.solve(power, residual)))
        return np.asarray(np.log(np.maximum(shares.max(axis=-1), 1e-12)))

    def thinned(self, every: int) -> Consistency:
        """Return the same at every n-th frequency."""
        s = self.spectra
        thin = Consistency(replace(s, f=s.f[::every], z=s.z[:, ::every]))
        thin.weight *= every
        return thin

    def misfits(self, hypotheses: Sequence[Sequence[Hypothesis]]) -> FloatArray:
        """Misfit of sets of hypotheses [set], all frequencies together."""
        out = [self.misfit(np.array([self.relations(h) for h in part])).sum(axis=-1) for part in _parts(hypotheses, 64)]
        return np.concatenate(out) if out else np.zeros(0)

    def clock_misfit(self, hypothesis: Hypothesis) -> float:
        """Misfit of a clock that drifts, which changes from window to window."""
        s = self.spectra
        residual: ComplexArray = np.zeros((len(s.f), *2 * (len(s.relations),)), dtype=complex)
        for z, time in zip(s.z, s.time, strict=True):
            a = corrected_relations(s, self.base, hypothesis, self.speed, float(time))
            r = np.einsum("fkm,fm->fk", a, z)
            residual += np.einsum("fi,fj->fij", r, r.conj())
        power = (self.base * self.power[:, None, :]) @ np.swapaxes(self.base.conj(), -1, -2)
        return float(self.weight * np.sum(_log_det(residual / self.windows) - _log_det(power)))


def _parts(hypotheses: Sequence[Sequence[Hypothesis]], size: int) -> list[Sequence[Sequence[Hypothesis]]]:
    return [hypotheses[i : i + size] for i in range(0, len(hypotheses), size)]


def _log_det(matrices: ComplexArray) -> FloatArray:
    """Logarithm of the determinants of Hermitian matrices; the ridge keeps exact relations finite."""
    k = matrices.shape[-1]
    trace = np.real(np.trace(matrices, axis1=-2, axis2=-1))[..., None, None] / k
    return np.asarray(np.linalg.slogdet(matrices + (1e-9 * trace + 1e-30) * np.eye(k))[1])
