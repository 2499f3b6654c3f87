"""Plan of a measurement campaign: what it would detect and determine, before anything is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from railui.campaign.campaign import Campaign
from railui.identification.context import create_context
from railui.identification.structure.candidates import Candidate
from railui.parallel import Pool
from railui.planning.expectation import Choice, Expectation
from railui.planning.information import Information, collect_information
from railui.planning.plan_file import RUN, PlanFile
from railui.planning.planned_runs import PlannedRun, planned_runs, simulate_runs
from railui.planning.selection import Selection, Step, reference
from railui.planning.store import InformationStore
from railui.progress import SILENT, Progress
from railui.runs.columns import columns_of
from railui.vehicle.model import Model

MIN_RUNS = 2  # one for estimation, one for validation


@dataclass(frozen=True)
class CandidateRuns:
    """Runs that may be made: those at which the nominal vehicle is stable, and the names of the others."""

    stable: tuple[PlannedRun, ...]
    unstable: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Plan:
    """Expected results of the runs that may be made, and the selection among sensors and runs.

    Attributes
    ----------
    runs
        Runs at which the nominal vehicle is stable.
    unstable
        Names of the others, which are left out.
    everything
        Expectation with all sensors and runs.
    steps
        Steps of the selection.
    """

    file: PlanFile
    runs: tuple[PlannedRun, ...]
    unstable: tuple[str, ...]
    information: Information
    everything: Expectation
    steps: tuple[Step, ...]

    @cached_property
    def chosen(self) -> Expectation | None:
        """Expectation of the selected sensors and runs; None where the budget allows for none."""
        return self.of_step(self.steps[-1]) if self.steps else None

    def of_run(self, number: int) -> Expectation:
        """Return the expectation with all sensors of one run that serves for estimation and validation."""
        choice = Choice(self.file.sensors, (number,), number)
        return expect(self.information, choice, self.file.campaign, self.everything.seed)

    def of_step(self, step: Step) -> Expectation:
        """Return the expectation of the selection after a step."""
        return expect(self.information, step.choice, self.file.campaign, self.everything.seed)


def expect(
    information: Information, choice: Choice, campaign: Campaign, seed: int, critical_score: float | None = None
) -> Expectation:
    """Return the expectation of a choice by the criteria of a campaign."""
    settings, gain = campaign.settings, campaign.min_relative_gain
    return Expectation(information, choice, settings, gain, seed, critical_score)


def candidate_runs(
    file: PlanFile,
    speeds: Sequence[float],
    tracks: Sequence[str | Path],
    duration: float,
    seed: int | None = None,
    sections: int = 1,
) -> CandidateRuns:
    """Return the runs that may be made with the nominal vehicle.

    Parameters
    ----------
    speeds
        Speeds [m/s] of the runs.
    tracks
        Specs or files; every speed is run on every track.
    duration
        Of a run [s].
    seed
        Of synthetic tracks.
    sections
        Places along each track from which a run may start.

    Raises
    ------
    FileProblems, ValueError
        For a faulty track, and for fewer than two runs at which the vehicle is stable.
    """
    campaign = file.campaign
    model = Model(campaign.design)
    wanted = planned_runs(speeds, tracks, duration, seed, sections)
    limit = campaign.settings.calibration.max_growth_rate
    stable = tuple(run for run in wanted if model.growth_rate(run.speed) <= limit)
    unstable = tuple(run.name for run in wanted if run not in stable)
    if len(stable) < MIN_RUNS:
        raise ValueError(
            f"{len(stable)} of {len(wanted)} runs can be planned, two are needed, for estimation and for validation: "
            + (f"the vehicle is unstable at {', '.join(unstable)}" if unstable else "give more speeds or tracks")
        )
    return CandidateRuns(stable, unstable)


def plan_of_runs(
    file: PlanFile,
    candidates: CandidateRuns,
    *,
    seed: int | None = None,
    jobs: int | None = None,
    progress: Progress = SILENT,
    store: InformationStore | None = None,
    cluster: Pool | None = None,
) -> Plan:
    """Simulate the runs and select sensors and runs.

    Parameters
    ----------
    seed
        Of the noise.
    store
        Where the information of every run is kept and found again.
    cluster
        Where the runs are computed; None: in this process.

    Raises
    ------
    ValueError
        Where the vehicle diverges.
    """
    campaign, stable = file.campaign, candidates.stable
    dataset = simulate_runs(campaign, Model(campaign.design), stable, file.sensors)
    context = create_context(dataset, seed=seed or 0, jobs=jobs, progress=progress)
    information = collect_information(context, store, cluster)
    numbers = tuple(range(len(stable)))
    everything = expect(information, Choice(file.sensors, numbers, numbers[-1]), campaign, context.seed)
    progress.message("selecting sensors and runs")
    steps = _select(file, stable, information, everything)
    return Plan(file, stable, candidates.unstable, information, everything, tuple(steps))


def _select(
    file: PlanFile, runs: Sequence[PlannedRun], information: Information, everything: Expectation
) -> list[Step]:
    critical = everything.critical_score

    @lru_cache(maxsize=1)  # pairs of runs are tried with one estimation run after the other
    def estimated(channels: tuple[str, ...], estimation: tuple[int, ...]) -> Expectation:
        choice = Choice(channels, estimation, estimation[0])
        return expect(information, choice, file.campaign, everything.seed, critical)

    def expected(choice: Choice) -> Expectation:
        return estimated(choice.channels, choice.estimation).validated_on(choice.validation)

    costs = {c: file.cost(c) for c in file.sensors}
    names = {i: run.name for i, run in enumerate(runs)}
    selection = Selection(file.sensors, names, costs, file.cost(RUN), expected, reference(everything))
    return selection.steps(file.budget)


def plan_document(plan: Plan) -> dict[str, Any]:
    """Return a plan as the JSON of `railui plan`."""
    file, chosen = plan.file, plan.chosen or plan.everything
    units = {c: columns_of(file.campaign.design.run_form)[c].unit for c in file.sensors}
    alone = [plan.of_run(i) for i in range(len(plan.runs))]
    notes = [f"left out: the nominal vehicle is unstable at {name}" for name in plan.unstable]
    if plan.chosen is None:
        notes.append("the budget does not cover one sensor and two runs: the figures are those of all sensors and runs")
    return {
        "design": file.campaign.design.name,
        "duration": plan.runs[0].duration,
        "sensors": [
            {"name": c, "noise": file.campaign.noise[c], "unit": units[c], "cost": file.cost(c)} for c in file.sensors
        ],
        "runs": [
            {
                "name": r.name,
                "speed": r.speed,
                "track": r.source.name,
                "start": r.start,
                "length": r.length,
                "cost": file.cost(RUN),
            }
            for r in plan.runs
        ],
        "budget": file.budget,
        "selected": None if plan.chosen is None else _selected(plan, plan.chosen.choice),
        "steps": [
            {"added": s.added, "cost": s.cost, "attained_share": s.share, **_selected(plan, s.choice)}
            for s in plan.steps
        ],
        "noise_floor": chosen.noise_floor,
        "critical_score": chosen.critical_score,
        "detectable": _detectable(plan, chosen, alone),
        "parameters": _parameters(plan, chosen, alone),
        "confounded": _confounded(chosen),
        "notes": notes,
    }


def _selected(plan: Plan, choice: Choice) -> dict[str, Any]:
    return {
        "sensors": list(choice.channels),
        "estimation": [plan.runs[i].name for i in choice.estimation],
        "validation": plan.runs[choice.validation].name,
    }


def _detectable(plan: Plan, chosen: Expectation, alone: Sequence[Expectation]) -> list[dict[str, Any]]:
    """Minimum detectable effects of the selection, with all sensors and runs, and of every run alone."""
    rows = {_key(row): row for row in chosen.detectable()}
    every = {_key(row): row for row in plan.everything.detectable()}
    by_run = [{_key(row): row["value"] for row in e.detectable()} for e in alone]
    entangled = [{(c.kind, c.at, c.wheelset) for c in e.rivals()} for e in (chosen, plan.everything, *alone)]
    by_step = [{_key(row): row["value"] for row in plan.of_step(s).detectable()} for s in plan.steps]
    return [
        {
            **rows.get(key, {**row, "value": None}),
            "with_everything": row["value"],
            "per_run": [values.get(key) for values in by_run],
            "per_step": [values.get(key) for values in by_step],
            "confounded": key in entangled[0],
            "confounded_with_everything": key in entangled[1],
            "confounded_per_run": [key in found for found in entangled[2:]],
        }
        for key, row in every.items()
    ]


def _key(row: Mapping[str, Any]) -> tuple[str, str, int | None]:
    return row["kind"], row["at"], row["wheelset"]


def _parameters(plan: Plan, chosen: Expectation, alone: Sequence[Expectation]) -> list[dict[str, Any]]:
    """Standard deviation of every estimate; priors included, whose own deviation says what the data add."""
    free, design = plan.information.free, plan.file.campaign.design
    return [
        {
            "path": path,
            "value": float(free.prior[i]),
            "unit": design.unit(path),
            "sd": float(chosen.parameter_sd[i]),
            "prior_sd": float(free.prior_sd[i]) if np.isfinite(free.prior_sd[i]) else None,
            "with_everything": float(plan.everything.parameter_sd[i]),
            "per_run": [float(e.parameter_sd[i]) for e in alone],
        }
        for i, path in enumerate(free.paths)
    ]


def _confounded(chosen: Expectation) -> list[dict[str, Any]]:
    """Effects that the selection detects before it can separate them from others."""
    return [
        {
            **_named(candidate),
            "from": [
                {**_named(r.candidate), "correlation": r.correlation, "separable_from": r.separable_from}
                for r in rivals
            ],
        }
        for candidate, rivals in chosen.rivals().items()
    ]


def _named(candidate: Candidate) -> dict[str, Any]:
    return {"kind": candidate.kind, "at": candidate.at, "wheelset": candidate.wheelset}
