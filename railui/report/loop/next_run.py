"""Rivals and the next run in the loop report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from railui.identification.result import LoopResult
from railui.planning.after import FinishedLoop, propose_runs
from railui.planning.component_bench import FREQUENCIES, PlannedBench
from railui.planning.next_run import NextRun
from railui.planning.planned_runs import PlannedRun
from railui.planning.rivals import RivalModel, rival_models, undecided
from railui.report.loop.wording import effect_title, location_text
from railui.vehicle.multibody import Structure

SHOWN: Final = 3  # runs in the report


def next_run_rows(result: LoopResult, rivals: Sequence[RivalModel]) -> list[dict[str, Any]]:
    """Return the best next runs with what each would separate; none where the data separate all rivals.

    A vehicle that hunts is left out: its motion from rest is not that of the run.
    """
    is_steady = result.nominal.design.is_on_track and result.windowed is None
    if len(undecided(rivals, result.context.settings.planning)) < 2 or not is_steady or result.is_out_of_time:
        return []
    loop = FinishedLoop(result.context, tuple(rivals), result.dataset.campaign.directory)
    try:
        found = propose_runs(loop, most=SHOWN)
    except ValueError:
        return []  # a track that is too short, or a rival that is unstable at all speeds
    return [run_row(run) for run in found]


def run_row(run: NextRun, structure: Structure | None = None) -> dict[str, Any]:
    """Return a run as data."""
    return {
        **(_bench(run.run, structure) if isinstance(run.run, PlannedBench) else _run_on_track(run.run)),
        "duration": run.run.duration,
        "sensors": list(run.sensors),
        "probability": run.probability,
        "prospects": [
            {"rival": p.rival, "probability": p.probability, "z": p.z, "equivalent": p.is_equivalent}
            for p in run.prospects
        ],
    }


def _run_on_track(run: PlannedRun) -> dict[str, Any]:
    return {"name": run.name, "speed": run.speed, "track": run.source.name, "start": run.start, "load": run.load}


def _bench(bench: PlannedBench, structure: Structure | None) -> dict[str, Any]:
    place = location_text(bench.at, bench.port or None, structure)
    return {
        "name": f"bench: {place}",
        "at": bench.at,
        "wheelset": bench.port or None,
        "amplitude": bench.amplitude,
        "frequencies": list(FREQUENCIES),
    }


def rivals_of(result: LoopResult) -> list[RivalModel]:
    """Return the rivals of a result; those on a rig are not compared on further runs."""
    return rival_models(result) if result.nominal.design.is_on_track else []


def rival_text(row: Mapping[str, Any], structure: Structure | None = None) -> str:
    """Name a rival by the effect in which it differs."""
    if row["kind"] is None:
        return "no effect"
    return f"{effect_title(row['kind'])}, {location_text(row['at'], row['wheelset'], structure)}"


def undecided_rows(report: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the rivals that the data do not separate from the final model."""
    return [row for row in report.get("rivals", ())[1:] if row["undecided"]]


def next_run_lines(report: Mapping[str, Any]) -> list[str]:
    """Return which rivals the data leave undecided and which run would separate them; nothing where there are none."""
    rows = undecided_rows(report)
    if not rows:
        return []
    is_weak = report["verdict"] == "none" and all(row["z"] < 0 for row in rows)
    opening = "Weak effects that these data do not exclude" if is_weak else "Not separated by these data from"
    lines = [f"{opening}: {'; '.join(rival_text(row) for row in rows)}."]
    if runs := report.get("next_runs"):
        best = runs[0]
        if all(p["equivalent"] for p in best["prospects"]):
            return [*lines, "They predict the same motion as the final model in every run considered."]
        sensors = " ".join(best["sensors"])
        lines.append(
            f"Next run: {best['name']}, {best['duration']:.0f} s with {sensors} decides with a probability of "
            f"{_percent(best['probability'])}."
        )
    return lines


def _percent(probability: float) -> str:
    """Return a probability that was estimated from few realisations; above 99 % without a number."""
    return "more than 99 %" if probability > 0.99 else f"{100 * probability:.0f} %"


def prospect_cells(run: Mapping[str, Any], rivals: int, missing: str = "–") -> list[str]:
    """Return the chance that a run separates the final model from each of the other rivals, as text."""
    chance = {p["rival"]: "same motion" if p["equivalent"] else _percent(p["probability"]) for p in run["prospects"]}
    return [chance.get(j, missing) for j in range(1, rivals + 1)]


def _nothing_undecided(report: Mapping[str, Any]) -> str:
    """Return what follows where no rival is undecided."""
    if not report.get("rivals"):
        return (
            "No rival model was compared. Runs at other speeds, amplitudes or frequencies test the final model further."
        )
    return (
        "No rival model is undecided at the 5 % level. A run at another speed or amplitude that decides nothing (role: "
        "test) shows whether the final model predicts it."
    )


def next_run_table(report: Mapping[str, Any], structure: Structure | None = None) -> dict[str, Any]:
    """Return the table of the page: a column per undecided rival, a row per run."""
    rows = undecided_rows(report)
    return {
        "note": _nothing_undecided(report),
        "rivals": [(rival_text(row, structure), f"{row['z']:.2f}") for row in rows],
        "runs": [
            {
                "name": run["name"],
                "sensors": " ".join(run["sensors"]),
                "duration": f"{run['duration']:.0f} s",
                "cells": prospect_cells(run, len(rows)),
            }
            for run in report.get("next_runs", ())
        ],
    }
