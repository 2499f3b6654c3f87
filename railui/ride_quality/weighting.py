"""Frequency weightings of human response to lateral and vertical vibration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import ComplexArray, FloatArray
from railui.dsp.discretise import discretise

Weight = Callable[[FloatArray], FloatArray | ComplexArray]


class AnalogFilter(NamedTuple):
    """Analog filter gain prod(s - zeros)/prod(s - poles), s in 1/s."""

    zeros: ComplexArray
    poles: ComplexArray
    gain: float

    def response(self, frequency: ArrayLike) -> ComplexArray:
        """Return the complex response at frequencies [Hz], in the shape of `frequency`."""
        s = 2j * np.pi * np.asarray(frequency, dtype=np.float64)
        response = np.full(s.shape, self.gain, dtype=np.complex128)
        for k in range(max(self.zeros.size, self.poles.size)):  # zero and pole in turn, so that nothing overflows
            response = response * (s - self.zeros[k] if k < self.zeros.size else 1.0)
            response = response / (s - self.poles[k] if k < self.poles.size else 1.0)
        return response

    def modulus(self, frequency: ArrayLike) -> FloatArray:
        """Return the modulus of the response at frequencies [Hz]."""
        return np.abs(self.response(frequency))


def _rational(numerator: Sequence[float], denominator: Sequence[float]) -> AnalogFilter:
    """Return the filter of two polynomials in s, highest power first."""
    top, bottom = np.asarray(numerator, dtype=np.float64), np.asarray(denominator, dtype=np.float64)
    zeros, poles = np.roots(top).astype(np.complex128), np.roots(bottom).astype(np.complex128)
    return AnalogFilter(zeros, poles, float(top[0] / bottom[0]))


def cascade(*parts: AnalogFilter) -> AnalogFilter:
    """Return filters in series; the identity for none."""
    zeros = np.concatenate([np.zeros(0, dtype=np.complex128), *(part.zeros for part in parts)])
    poles = np.concatenate([np.zeros(0, dtype=np.complex128), *(part.poles for part in parts)])
    return AnalogFilter(zeros, poles, float(np.prod([part.gain for part in parts])))


def band_limits(f1: float, f2: float) -> tuple[AnalogFilter, AnalogFilter]:
    """Return a second-order Butterworth high-pass at f1 and low-pass at f2 [Hz], both of Q = 1/sqrt 2."""
    w1, w2 = 2 * np.pi * f1, 2 * np.pi * f2
    high = _rational([1.0, 0.0, 0.0], [1.0, np.sqrt(2) * w1, w1**2])
    low = _rational([w2**2], [1.0, np.sqrt(2) * w2, w2**2])
    return high, low


def transition(f3: float, f4: float, q4: float) -> AnalogFilter:
    """Return the acceleration-velocity transition (1 + s/w3)/(1 + s/(Q4 w4) + (s/w4)^2), f in Hz."""
    w3, w4 = 2 * np.pi * f3, 2 * np.pi * f4
    return _rational([1 / w3, 1.0], [1 / w4**2, 1 / (q4 * w4), 1.0])


def upward_step(f5: float, q5: float, f6: float, q6: float) -> AnalogFilter:
    """Return the upward step (w5/w6)^2 (1 + s/(Q5 w5) + (s/w5)^2)/(1 + s/(Q6 w6) + (s/w6)^2), f in Hz."""
    w5, w6 = 2 * np.pi * f5, 2 * np.pi * f6
    rise = _rational([1 / w5**2, 1 / (q5 * w5), 1.0], [1 / w6**2, 1 / (q6 * w6), 1.0])
    return rise._replace(gain=rise.gain * (w5 / w6) ** 2)


def transmissibility(frequency: float, damping: float) -> AnalogFilter:
    """Return the transmissibility (2 z w0 s + w0^2)/(s^2 + 2 z w0 s + w0^2) of a mass on spring and damper.

    `frequency` [Hz], damping ratio `damping` z: a floor on its secondary suspension, or a seat cushion. Raises
    ValueError if either is not positive.

    >>> round(float(transmissibility(1.2, 0.2).modulus(1.2)), 4)  # sqrt(1 + 1/(2 z)^2)
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
"""Lateral weighting of ISO 2631 in the 1970s as a streaming filter, which a brick wall cannot be.

Second-order band limits at 1 and 80 Hz replace the steps; f4^2/f3 = 2 Hz makes the slope 2/f, and f3, Q4 are chosen so
that the rms agrees within 2 %: +1.8 % for white acceleration, with and without the floor of 1.2 Hz, damping 0.2;
-1.1 % for ERRI B176 at 20 to 60 m/s through that floor, -1.6 % with a bogie resonance at 2.5 Hz in addition. Relative
to `brick_wall_1974`, in dB: -2.0 at 1 Hz, -0.4 at 1.25, 0.0 at 1.5, -0.6 at 2, +0.2 from 3 to 4, within 0.1 from 8 to
31.5, -1.4 at 63, -3.0 at 80. Outside the band of the wall its gain is 0.25 at 0.5 Hz and 0.003 at 160 Hz. (With the
transition of W_d, 2 Hz and Q 0.63, white acceleration through that floor would be 8 % low.)
"""

# 0.737 |1.911^0.5 x + 0.25 x^2| / |1 + 1.563 x + 0.277 x^2 + 0.0368 x^3| with x = j f, then x = s/(2 pi)
_TWO_PI: Final = 2 * np.pi
SPERLING_B: Final = _rational(
    [0.737 * 0.25 / _TWO_PI**2, 0.737 * np.sqrt(1.911) / _TWO_PI, 0.0],
    [0.0368 / _TWO_PI**3, 0.277 / _TWO_PI**2, 1.563 / _TWO_PI, 1.0],
)
"""Sperling's lateral comfort weighting B(f) as a rational function with this modulus."""


def sperling_b(frequency: ArrayLike) -> FloatArray:
    """Return Sperling's B(f) by its formula, f in Hz, to verify `SPERLING_B`.

    >>> round(float(sperling_b(5.0)), 4)
    1.0188
    """
    f = np.asarray(frequency, dtype=np.float64)
    top = 1.911 * f**2 + (0.25 * f**2) ** 2
    bottom = (1 - 0.277 * f**2) ** 2 + (1.563 * f - 0.0368 * f**3) ** 2
    return np.asarray(0.737 * np.sqrt(top / bottom), dtype=np.float64)


def brick_wall_1974(frequency: ArrayLike) -> FloatArray:
    """Return the lateral weighting of ISO 2631 in the 1970s: 0 below 1 Hz, 1 at 1 to 2, 2/f to 80 Hz, 0 above.

    >>> brick_wall_1974([0.99, 1.0, 2.0, 8.0, 80.0, 81.0]).tolist()
    [0.0, 1.0, 1.0, 0.25, 0.025, 0.0]
    """
    f = np.asarray(frequency, dtype=np.float64)
    inside = (f >= 1.0) & (f <= 80.0)
    return np.where(inside, 2.0 / np.maximum(f, 2.0), 0.0)


COMFORT_WEIGHTS: Final[dict[str, AnalogFilter]] = {
    "weighted_acceleration": W_D,
    "weighted_acceleration_1974": W_1974,
    "wz": SPERLING_B,
}
"""Weightings that the kernel applies during the ride, by the name of the statistic that is their rms."""


def weighted_rms(x: ArrayLike, dt: float, weight: AnalogFilter | Weight) -> float:
    """Compute the rms of a weighted signal in the frequency domain, to verify the streaming filters.

    Convention: the transform of the record with its mean, without a window, followed by as many zeros, so that its end
    does not run into its start; each line times the complex response; the rms of the filtered signal over the record.

    Parameters
    ----------
    x : array_like
        Signal [n].
    dt : float
        Time between samples [s].
    weight : AnalogFilter or callable
        Filter, or a response, complex or real, as a function of the frequency [Hz].

    Raises
    ------
    ValueError
        For a record without samples.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(4000) / 400
    >>> round(weighted_rms(np.sqrt(2) * np.sin(2 * np.pi * 4 * t), 1 / 400, W_D), 4)  # with the start of the filter
    0.5132
    """
    signal = np.asarray(x, dtype=np.float64)
    response = weight.response if isinstance(weight, AnalogFilter) else weight
    n = signal.size
    if n == 0:
        raise ValueError("a record without samples has no rms")
    frequency = np.asarray(np.fft.rfftfreq(2 * n, dt), dtype=np.float64)
    filtered = np.fft.irfft(np.fft.rfft(signal, 2 * n) * response(frequency), 2 * n)[:n]
    return float(np.sqrt(np.mean(filtered**2)))


class ComfortPoint(Protocol):
    """Settings of the transfer from the frame to the passenger: frequencies [Hz], damping ratios."""

    @property
    def floor_frequency(self) -> float: ...
    @property
    def floor_damping(self) -> float: ...
    @property
    def cushion_frequency(self) -> float | None: ...
    @property
    def cushion_damping(self) -> float | None: ...


def isolation_stages(riding: ComfortPoint, floor: bool = True) -> tuple[tuple[float, float], ...]:
    """Return frequency [Hz] and damping ratio of every mass on spring and damper from the frame to the comfort point.

    The floor (unless `floor` is False: the acceleration is that of the floor itself) and the cushion, if the settings
    have one. Raises ValueError for a cushion with only one of both values.
    """
    cushion = (riding.cushion_frequency, riding.cushion_damping)
    if cushion.count(None) == 1:
        raise ValueError(f"a cushion needs both cushion_frequency and cushion_damping: {cushion[0]}, {cushion[1]}")
    stages = ((riding.floor_frequency, riding.floor_damping),) if floor else ()
    return stages if cushion[0] is None or cushion[1] is None else (*stages, (cushion[0], cushion[1]))


def comfort_cascades(riding: ComfortPoint, dt: float, floor: bool = True) -> dict[str, FloatArray]:
    """Return the streaming filters of the comfort point, computed once per set of settings and read-only.

    `weighted_acceleration` is W_d, `weighted_acceleration_1974` the weighting of that edition, `wz` Sperling's B; each
    in series with the floor transfer and the cushion, if the settings have one.

    Parameters
    ----------
    riding : ComfortPoint
        Settings.
    dt : float
        Time between samples [s].
    floor : bool
        Include the floor transfer; False if the carbody is modelled and the acceleration is that of its floor.

    Returns
    -------
    dict of FloatArray
        Sections [n, 6] by statistic.

    Raises
    ------
    ValueError
        For a frequency or damping that is not positive, and for a cushion with only one of both values.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> point = dict(floor_frequency=1.2, floor_damping=0.2, cushion_frequency=None, cushion_damping=None)
    >>> filters = comfort_cascades(SimpleNamespace(**point), 0.0025)
    >>> {name: sections.shape for name, sections in filters.items()}
    {'weighted_acceleration': (4, 6), 'weighted_acceleration_1974': (4, 6), 'wz': (3, 6)}
    """
    return dict(_cascades(isolation_stages(riding, floor), float(dt)))


@lru_cache(maxsize=256)
def _cascades(stages: tuple[tuple[float, float], ...], dt: float) -> tuple[tuple[str, FloatArray], ...]:
    filters = []
    for name, weight in COMFORT_WEIGHTS.items():
        sections = discretise(cascade(*(transmissibility(*stage) for stage in stages), weight), dt)
        sections.setflags(write=False)
        filters.append((name, sections))
    return tuple(filters)
