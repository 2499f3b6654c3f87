"""The next run: which one would separate the rival models of a loop.

The probability that a run decides is that of Vuong's test being clear in favour of the true rival, over realisations of
the noise and of the true parameters about their estimates, with each rival taken as true in turn. Rivals that predict
the same motion in every run that may be made count as one model: no such run can decide between them, nor need it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.settings.planning import PlanningSettings
from railui.identification.context import Context
from railui.parallel import map_threads
from railui.planning.component_bench import FORCE, PlannedBench, simulate_bench
from railui.planning.noise_residuals import SensorNoise
from railui.planning.planned_runs import PlannedRun
from railui.planning.rival_runs import PredictedRun, RivalRun, draw_seeds, predict_run
from railui.planning.rivals import RivalModel


@dataclass(frozen=True)
class Prospect:
    """Chance that a run separates the final model (rival 0) from another.

    Attributes
    ----------
    rival
        Number of the other model.
    probability
        Mean over both being true.
    z
        Expected statistic, the smaller of both cases.
    is_equivalent
        True where both predict the same motion in every run that may be made.
    """

    rival: int
    probability: float
    z: float
    is_equivalent: bool = False


@dataclass(frozen=True, eq=False)
class NextRun:
    """A run that may be made next with a set of sensors, and what it would separate.

    Attributes
    ----------
    probability
        Chance that it decides for the true rival against all that are not equivalent to it, the mean over every rival
        being true; 0 where all are equivalent.
    """

    run: PlannedRun | PlannedBench
    sensors: tuple[str, ...]
    prospects: tuple[Prospect, ...]
    probability: float


@dataclass(frozen=True, eq=False)
class _Assessment:
    """Chances [i, j] and expected statistics [i, j] of a run with a set of sensors; differences [i, j] of motions."""

    run: PlannedRun | PlannedBench
    sensors: tuple[str, ...]
    chance: FloatArray
    z: FloatArray
    differences: FloatArray

    def next_run(self, equivalent: NDArray[np.bool_]) -> NextRun:
        """Return the run with its prospects."""
        n = len(self.chance)
        prospects = [
            Prospect(
                j,
                float(np.nanmean([self.chance[0, j], self.chance[j, 0]])),
                float(np.nanmin([self.z[0, j], self.z[j, 0]])),
                bool(equivalent[0, j]),
            )
            for j in range(1, n)
            if np.any(np.isfinite([self.chance[0, j], self.chance[j, 0]]))
        ]
        # the least certain of its comparisons decides: they share the noise, so that their chances do not multiply
        rows = [self.chance[i][~equivalent[i] & np.isfinite(self.chance[i])] for i in range(n)]
        least = [float(np.min(row)) for row in rows if row.size]
        return NextRun(self.run, self.sensors, tuple(prospects), float(np.mean(least)) if least else 0.0)


def next_runs(
    context: Context,
    rivals: Sequence[RivalModel],
    runs: Sequence[PlannedRun],
    sensors: Sequence[str],
    more: Sequence[str] = (),
    benches: Sequence[PlannedBench] = (),
    most: int | None = None,
) -> list[NextRun]:
    """Assess runs with the sensors of a campaign and with each of further sensors, and benches, the best first.

    Parameters
    ----------
    rivals
        The final model first.
    more
        Sensors that may be added, whose noise is that of the context.
    most
        Number of runs whose chance is computed: those in which the predictions of the rivals differ most; None: all.
    """
    settings = context.settings.planning
    sets = [tuple(sensors), *((*sensors, c) for c in more)]
    noise = SensorNoise(context, draw_seeds(context, 2))

    def predict(run: PlannedRun) -> PredictedRun | None:
        return predict_run(context, rivals, run, [*sensors, *more])

    def assess(run: PredictedRun | None) -> list[_Assessment]:
        return [] if run is None else _assess(run.run, run.with_noise(context, noise), sets, settings)

    def assess_bench(bench: PlannedBench) -> list[_Assessment]:
        return _assess(bench, simulate_bench(context, rivals, bench), [(FORCE,)], settings)

    known: list[PredictedRun] = []
    if most is None or most >= len(runs):  # one after the other: predictions take much memory
        parts = list(map_threads(lambda run: assess(predict(run)), runs, context.jobs))
    else:
        known = [run for run in map_threads(predict, runs, context.jobs) if run is not None]
        parts = list(map_threads(assess, _most_separated(known, settings)[:most], context.jobs))
    parts += map_threads(assess_bench, benches, context.jobs)
    found = [one for part in parts for one in part]
    equivalent = equivalent_rivals(found, settings, [run.predicted.differences for run in known])
    return sorted((one.next_run(equivalent) for one in found), key=lambda r: -r.probability)


def _most_separated(runs: Sequence[PredictedRun], settings: PlanningSettings) -> list[PredictedRun]:
    """Order runs by the distances of all rivals from the nearest that is not equivalent, the largest sum first."""
    if not runs:
        return []
    apart = np.max([run.predicted.differences for run in runs], axis=0) >= settings.equivalent_difference

    def separation(run: PredictedRun) -> float:
        nearest = np.min(np.sqrt(run.predicted.squares), axis=1, where=apart, initial=np.inf)
        return float(np.sum(nearest[np.isfinite(nearest)]))

    return sorted(runs, key=lambda run: -separation(run))


def _assess(
    run: PlannedRun | PlannedBench,
    simulated: RivalRun | None,
    sets: Sequence[tuple[str, ...]],
    settings: PlanningSettings,
) -> list[_Assessment]:
    """Assess a simulated run with every set of sensors; nothing where a rival diverges."""
    if simulated is None:
        return []
    differences = simulated.predicted.differences
    return [_Assessment(run, one, *simulated.statistics(one, settings.critical_z), differences) for one in sets]


def equivalent_rivals(
    assessed: Sequence[_Assessment], settings: PlanningSettings, differences: Sequence[FloatArray] = ()
) -> NDArray[np.bool_]:
    """Return which rivals [i, j] predict the same motion in all runs, so that none of them decides between the two.

    differences: those [i, j] of the motions in runs whose chance was not computed.
    """
    if not assessed:
        return np.zeros((0, 0), dtype=bool)
    apart = np.max([*(a.differences for a in assessed), *differences], axis=0)
    best = np.fmax.reduce([0.5 * (a.chance + a.chance.T) for a in assessed])
    return np.asarray((apart < settings.equivalent_difference) & ~(best >= settings.equivalent_chance))


__all__ = ["NextRun", "Prospect", "next_runs"]
