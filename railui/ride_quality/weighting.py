"""Frequency weightings of human response to lateral and vertical vibration: analog filters and moduli."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import ComplexArray, FloatArray
from railui.dsp.discretise import discretise

Weight = Callable[[FloatArray], FloatArray]


class Analog(NamedTuple):
    """A filter in s [1/s]: gain prod(s - zeros)/prod(s - poles)."""

    zeros: ComplexArray
    poles: ComplexArray
    gain: float

    def response(self, frequency: ArrayLike) -> ComplexArray:
        """The complex response at frequencies [Hz], shape of `frequency`."""
        s = 2j * np.pi * np.asarray(frequency, dtype=np.float64)
        found = np.full(s.shape, self.gain, dtype=np.complex128)
        for k in range(max(self.zeros.size, self.poles.size)):  # one of each, so that nothing overflows
            found = found * (s - self.zeros[k] if k < self.zeros.size else 1.0)
            found = found / (s - self.poles[k] if k < self.poles.size else 1.0)
        return found

    def modulus(self, frequency: ArrayLike) -> FloatArray:
        """The modulus of the response at frequencies [Hz]."""
        return np.abs(self.response(frequency))


def _rational(numerator: Sequence[float], denominator: Sequence[float]) -> Analog:
    """A filter from polynomials in s, highest power first."""
    top, bottom = np.asarray(numerator, dtype=np.float64), np.asarray(denominator, dtype=np.float64)
    zeros, poles = np.roots(top).astype(np.complex128), np.roots(bottom).astype(np.complex128)
    return Analog(zeros, poles, float(top[0] / bottom[0]))


def cascade(*parts: Analog) -> Analog:
    """Filters one after the other; none passes everything."""
    zeros = np.concatenate([np.zeros(0, dtype=np.complex128), *(part.zeros for part in parts)])
    poles = np.concatenate([np.zeros(0, dtype=np.complex128), *(part.poles for part in parts)])
    return Analog(zeros, poles, float(np.prod([part.gain for part in parts])))


def band_limits(f1: float, f2: float) -> tuple[Analog, Analog]:
    """Second-order Butterworth high pass at f1 and low pass at f2 [Hz], both of Q = 1/sqrt 2."""
    w1, w2 = 2 * np.pi * f1, 2 * np.pi * f2
    high = _rational([1.0, 0.0, 0.0], [1.0, np.sqrt(2) * w1, w1**2])
    low = _rational([w2**2], [1.0, np.sqrt(2) * w2, w2**2])
    return high, low


def transition(f3: float, f4: float, q4: float) -> Analog:
    """From constant acceleration to constant velocity: (1 + s/w3)/(1 + s/(Q4 w4) + (s/w4)^2), f in Hz."""
    w3, w4 = 2 * np.pi * f3, 2 * np.pi * f4
    return _rational([1 / w3, 1.0], [1 / w4**2, 1 / (q4 * w4), 1.0])


def upward_step(f5: float, q5: float, f6: float, q6: float) -> Analog:
    """(w5/w6)^2 (1 + s/(Q5 w5) + (s/w5)^2)/(1 + s/(Q6 w6) + (s/w6)^2), f in Hz."""
    w5, w6 = 2 * np.pi * f5, 2 * np.pi * f6
    rise = _rational([1 / w5**2, 1 / (q5 * w5), 1.0], [1 / w6**2, 1 / (q6 * w6), 1.0])
    return rise._replace(gain=rise.gain * (w5 / w6) ** 2)


def one_mass(frequency: float, damping: float) -> Analog:
    """What a mass on spring and damper passes on, (2 z w0 s + w0^2)/(s^2 + 2 z w0 s + w0^2).

    `frequency` [Hz], `damping` the share z of critical damping: a floor on its secondary suspension, a seat
    cushion. Raises ValueError where either is not positive.

    >>> round(float(one_mass(1.2, 0.2).modulus(1.2)), 4)  # sqrt(1 + 1/(2 z)^2)
    2.6926
    """
    if not (frequency > 0 and damping > 0):
        raise ValueError(f"frequency and damping must be positive: {frequency:g} Hz, {damping:g}")
    w0 = 2 * np.pi * frequency
    return _rational([2 * damping * w0, w0**2], [1.0, 2 * damping * w0, w0**2])


W_D: Final = cascade(*band_limits(0.4, 100.0), transition(2.0, 2.0, 0.63))
"""W_d of ISO 2631-1:1997, horizontal. The printed 0.212 at 10 Hz is a misprint: the filter gives 0.2017."""

W_K: Final = cascade(*band_limits(0.4, 100.0), transition(12.5, 12.5, 0.63), upward_step(2.37, 0.91, 3.35, 0.91))
"""W_k of ISO 2631-1:1997, vertical."""

W_1974: Final = cascade(*band_limits(1.0, 80.0), transition(1.4, np.sqrt(2 * 1.4), 0.68))
"""The lateral weighting of ISO 2631 in the 1970s as it streams: a brick wall cannot.

Second-order band limits at 1 and 80 Hz stand for the steps; f4^2/f3 = 2 Hz makes the fall 2/f, and f3, Q4
are chosen so that the rms agrees within 2 %: +1.8 % for white acceleration, with and without the floor of
1.2 Hz, damping 0.2; -1.1 % for ERRI B176 at 20 to 60 m/s through that floor, -1.6 % with a bogie's
resonance at 2.5 Hz besides. Against `brick_wall_1974`, in dB: -2.0 at 1 Hz, -0.4 at 1.25, 0.0 at 1.5, -0.6
at 2, +0.2 from 3 to 4, within 0.1 from 8 to 31.5, -1.4 at 63, -3.0 at 80; of what the wall shuts out it
passes 0.25 at 0.5 Hz and 0.003 at 160. (With the transition of W_d, 2 Hz and Q 0.63, white acceleration
through that floor would be 8 % low.)
"""

# 0.737 |1.911^0.5 x + 0.25 x^2| / |1 + 1.563 x + 0.277 x^2 + 0.0368 x^3| with x = j f, then x = s/(2 pi)
_TURN: Final = 2 * np.pi
SPERLING_B: Final = _rational(
    [0.737 * 0.25 / _TURN**2, 0.737 * np.sqrt(1.911) / _TURN, 0.0],
    [0.0368 / _TURN**3, 0.277 / _TURN**2, 1.563 / _TURN, 1.0],
)
"""Sperling's comfort weighting B(f), lateral, as the rational function whose modulus it is."""


def sperling_b(frequency: ArrayLike) -> FloatArray:
    """Sperling's B(f) by its formula, f in Hz: the reference for `SPERLING_B`.

    >>> round(float(sperling_b(5.0)), 4)
    1.0188
    """
    f = np.asarray(frequency, dtype=np.float64)
    top = 1.911 * f**2 + (0.25 * f**2) ** 2
    bottom = (1 - 0.277 * f**2) ** 2 + (1.563 * f - 0.0368 * f**3) ** 2
    return np.asarray(0.737 * np.sqrt(top / bottom), dtype=np.float64)


def brick_wall_1974(frequency: ArrayLike) -> FloatArray:
    """The lateral weighting of ISO 2631 in the 1970s: 0 below 1 Hz, 1 at 1 to 2, 2/f to 80 Hz, 0 above.

    >>> brick_wall_1974([0.99, 1.0, 2.0, 8.0, 80.0, 81.0]).tolist()
    [0.0, 1.0, 1.0, 0.25, 0.025, 0.0]
    """
    f = np.asarray(frequency, dtype=np.float64)
    inside = (f >= 1.0) & (f <= 80.0)
    return np.where(inside, 2.0 / np.maximum(f, 2.0), 0.0)


COMFORT_WEIGHTS: Final[dict[str, Analog]] = {
    "weighted_acceleration": W_D,
    "weighted_acceleration_1974": W_1974,
    "wz": SPERLING_B,
}
"""What the kernel streams, by the name of the statistic that its rms becomes."""


def weighted_rms(x: ArrayLike, dt: float, weight: Analog | Weight) -> float:
    """The rms of a weighted signal, in the frequency domain: the reference of the streaming filters.

    x [n] has its unit and `dt` [s] between samples; `weight` is a filter or a function of f [Hz]. Convention:
    the transform of the whole record, its mean kept and no window, each line times the weight, and the root of
    the mean square over the record (which so counts as one period). Raises ValueError for a record without
    samples.

    >>> import numpy as np
    >>> t = np.arange(4000) / 400
    >>> round(weighted_rms(np.sqrt(2) * np.sin(2 * np.pi * 4 * t), 1 / 400, W_D), 4)
    0.5119
    """
    signal = np.asarray(x, dtype=np.float64)
    modulus = weight.modulus if isinstance(weight, Analog) else weight
    n = signal.size
    if n == 0:
        raise ValueError("a record without samples has no rms")
    frequency = np.asarray(np.fft.rfftfreq(n, dt), dtype=np.float64)
    line = np.abs(np.fft.rfft(signal)) * modulus(frequency) / n
    twice = np.full(line.size, 2.0)  # each line but the mean and the last of an even record stands for two
    twice[0] = 1.0
    if n % 2 == 0:
        twice[-1] = 1.0
    return float(np.sqrt(np.sum(twice * line**2)))


class ComfortPoint(Protocol):
    """The settings that lead from the frame to the passenger: frequencies [Hz], damping ratios."""

    @property
    def floor_frequency(self) -> float: ...
    @property
    def floor_damping(self) -> float: ...
    @property
    def cushion_frequency(self) -> float | None: ...
    @property
    def cushion_damping(self) -> float | None: ...


def masses_before(riding: ComfortPoint, floor: bool = True) -> tuple[tuple[float, float], ...]:
    """Frequency [Hz] and damping ratio of every mass on spring and damper between the frame and the comfort point.

    The floor (not `floor`: the acceleration is that of the floor itself) and the cushion, where the settings name
    one. Raises ValueError for a cushion of which only one of the two is given.
    """
    cushion = (riding.cushion_frequency, riding.cushion_damping)
    if cushion.count(None) == 1:
        raise ValueError(f"a cushion needs both cushion_frequency and cushion_damping: {cushion[0]}, {cushion[1]}")
    found = ((riding.floor_frequency, riding.floor_damping),) if floor else ()
    return found if cushion[0] is None or cushion[1] is None else (*found, (cushion[0], cushion[1]))


def comfort_cascades(riding: ComfortPoint, dt: float, floor: bool = True) -> dict[str, FloatArray]:
    """The streaming filters of the comfort point at interval `dt` [s]: sections [n, 6] by statistic.

    `weighted_acceleration` is W_d, `weighted_acceleration_1974` the weighting of that edition, `wz`
    Sperling's B; each behind the floor transfer (`floor` False: the coach is in the model and its floor is
    measured) and the cushion, where the settings name one. Worked out once per set of settings; read-only.
    Raises ValueError for a frequency or damping that is not positive, and for a cushion of which only one
    of the two is given.

    >>> from types import SimpleNamespace
    >>> point = dict(floor_frequency=1.2, floor_damping=0.2, cushion_frequency=None, cushion_damping=None)
    >>> found = comfort_cascades(SimpleNamespace(**point), 0.0025)
    >>> {name: sections.shape for name, sections in found.items()}
    {'weighted_acceleration': (4, 6), 'weighted_acceleration_1974': (4, 6), 'wz': (3, 6)}
    """
    return dict(_cascades(masses_before(riding, floor), float(dt)))


@lru_cache(maxsize=256)
def _cascades(masses: tuple[tuple[float, float], ...], dt: float) -> tuple[tuple[str, FloatArray], ...]:
    found = []
    for name, weight in COMFORT_WEIGHTS.items():
        sections = discretise(cascade(*(one_mass(*factor) for factor in masses), weight), dt)
        sections.setflags(write=False)
        found.append((name, sections))
    return tuple(found)
