"""A component on a bench as the next test: its motion is prescribed, and rivals differ in the force that they predict.

The components are those at which an undecided effect acts. Sines of two amplitudes at several frequencies separate laws
of displacement, of speed and with memory.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.identification.component_force import elements_at_port, restoring_force
from railui.identification.context import Context
from railui.identification.prediction import Predictor
from railui.planning.decision import Decision, compare_misfits
from railui.planning.rival_runs import DIFFERENCE, DRAWS, Misfit, Prediction, RivalPredictions, RivalRun, block_samples
from railui.planning.rivals import RivalModel
from railui.vehicle.model import Model

FREQUENCIES = (0.5, 1.0, 2.0, 5.0)  # Hz
SMALL_AMPLITUDE = 0.25  # of the large one
SINE_DURATION = 4.0  # s, whole periods of every frequency
SAMPLING_RATE = 200.0  # Hz
FORCE_NOISE = 0.01  # of the rms of the force: a load cell
NOISE_SEED = 31
FORCE = "F"  # column of a run on a bench


@dataclass(frozen=True)
class PlannedBench:
    """A component of a vehicle on a bench.

    Attributes
    ----------
    at, port
        Location and number of the wheelset, or 0 where there is one such component.
    amplitude
        Of the large sines [m or rad]: that of the motion in the vehicle.
    """

    at: str
    port: int
    amplitude: float

    @property
    def duration(self) -> float:
        """Length of the test [s]."""
        return 2 * len(FREQUENCIES) * SINE_DURATION

    def motion(self) -> FloatArray:
        """Prescribed motion [n]: sines of both amplitudes at every frequency."""
        t = np.arange(round(SINE_DURATION * SAMPLING_RATE)) / SAMPLING_RATE
        sines = [np.sin(2.0 * np.pi * f * t) for f in FREQUENCIES]
        return self.amplitude * np.concatenate([*sines, *(SMALL_AMPLITUDE * x for x in sines)])


def planned_benches(context: Context, rivals: Sequence[RivalModel]) -> list[PlannedBench]:
    """Return a bench for every component at which an effect of a rival acts, moved as far as in the estimation runs."""
    model = rivals[0].model
    return benches_at(context, model, sorted({port for rival in rivals for port in _ports(rival, model)}))


def component_ports(model: Model) -> list[tuple[str, int]]:
    """Return the location and number of every spring or damper that a bench can hold."""
    return sorted(key for key, x in model.local_elements.items() if any(x) and key[1] != core.LINKAGE_NUMBER)


def benches_at(context: Context, model: Model, ports: Sequence[tuple[str, int]]) -> list[PlannedBench]:
    """Return a bench for each component, moved as far as in the estimation runs; none for one that does not move."""
    segments = context.dataset.estimation
    names = [f"z.{at}.{port}" for at, port in ports]
    peaks = np.zeros(len(ports))
    for segment in segments if ports else ():
        series, diverged = Predictor(model, segment).simulate(names)
        if diverged[0] < 0:
            peaks = np.maximum(peaks, np.abs(series[0]).max(axis=1))
    return [PlannedBench(at, port, float(x)) for (at, port), x in zip(ports, peaks, strict=True) if x > 0.0]


def _ports(rival: RivalModel, model: Model) -> Iterator[tuple[str, int]]:
    """Yield the ports with a spring or damper at which the effect of a rival acts."""
    candidate = rival.candidate
    if candidate is None or "rig" not in core.effect_record(candidate.kind)["at"]:
        return
    for at, port in component_ports(model):
        if at == candidate.at and candidate.wheelset in (None, port):
            yield at, port


def simulate_bench(context: Context, rivals: Sequence[RivalModel], bench: PlannedBench) -> RivalRun | None:
    """Simulate a bench with every rival as truth and predict it by every rival; None where one diverges."""
    z, dt = bench.motion(), 1.0 / SAMPLING_RATE
    try:
        sd = FORCE_NOISE * float(np.std(_force(rivals[0].model, bench, z, dt)))
        if not sd > 0.0:
            return None
        predictions = [predict_force(context, r, bench, z, dt, sd) for r in rivals]
        bare = [_force(r.without_effect(), bench, z, dt)[None] / sd for r in rivals]
        truths = [_draw_truths(context, r, bench, z, dt, i) / sd for i, r in enumerate(rivals)]
    except ValueError:
        return None
    noise = np.random.default_rng(np.random.SeedSequence([context.seed, NOISE_SEED])).standard_normal(
        (DRAWS, 1, len(z))
    )
    return RivalRun(RivalPredictions((FORCE,), predictions, bare), [x + noise for x in truths])


def predict_force(
    context: Context, rival: RivalModel, bench: PlannedBench, z: FloatArray, dt: float, sd: float
) -> Prediction:
    """Predict the force [1, n] over its noise `sd` that a rival resists a motion z [n] with.

    Raises
    ------
    ValueError
        Where the component diverges.
    """
    values = rival.values()
    rows = [values, *(values + DIFFERENCE * axis for axis in rival.deviations.T)]
    forces = np.array([_force(rival.with_values(row), bench, z, dt) for row in rows])[:, None] / sd
    share = context.settings.calibration.independent_sample_share
    return Prediction(forces[0], (forces[1:] - forces[0]) / DIFFERENCE, share, block_samples(context, dt))


def _draw_truths(
    context: Context, rival: RivalModel, bench: PlannedBench, z: FloatArray, dt: float, index: int
) -> FloatArray:
    """Forces [draw, 1, n] of components drawn about the estimates of a rival."""
    rng = np.random.default_rng(np.random.SeedSequence([context.seed, NOISE_SEED, index]))
    return np.array([_force(rival.with_values(x), bench, z, dt) for x in rival.draw(rng, DRAWS)])[:, None]


def _force(model: Model, bench: PlannedBench, z: FloatArray, dt: float) -> FloatArray:
    """Force [n] of the component without its mean, which a preload shifts."""
    force, _ = restoring_force(z, dt, *elements_at_port(model, bench.at, bench.port))
    return np.asarray(force - force.mean())


def component(model: Model, place: str) -> PlannedBench:
    """Return the component at a place such as `primary_lateral.2`, without a number the first.

    Raises
    ------
    ValueError
        Where the vehicle has no spring or damper there.
    """
    at, _, number = place.partition(".")
    every = component_ports(model)
    ports = [port for name, port in every if name == at and number in ("", str(port))]
    if not ports:
        known = ", ".join(sorted({name for name, _ in every}))
        raise ValueError(f"no component at {place}: components are at {known}, with a number as in {at or 'NAME'}.2")
    return PlannedBench(at, ports[0], 0.0)


def decide_bench(
    context: Context, rivals: Sequence[RivalModel], bench: PlannedBench, segments: Sequence[Segment]
) -> list[Decision]:
    """Compare the final model with each other rival on measured forces of a component, by Vuong's test.

    The noise of the force only bounds how far the estimates may move.

    Parameters
    ----------
    segments
        With the columns `z` and `F`, in SI.
    """
    misfits: list[list[Misfit]] = [[] for _ in rivals]
    for segment in segments:
        force = segment.columns[FORCE]
        sd = FORCE_NOISE * float(np.std(force))
        if not sd > 0.0:
            raise ValueError("the measured force does not change: no model can be compared with it")
        measured = (force - force.mean())[None, None] / sd
        for rival, found in zip(rivals, misfits, strict=True):
            prediction = predict_force(context, rival, bench, segment.columns["z"], segment.dt, sd)
            found += prediction.products(measured).misfits([0])
    return compare_misfits(misfits, context.settings.planning)
