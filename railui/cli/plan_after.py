"""railui plan --after: the next run after a loop, and the decision on it once it is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from railui.cli.invocation import Invocation, StatusLine, usage_error, usage_errors
from railui.cli.tables import make_table

if TYPE_CHECKING:
    from railui.planning.after import FinishedLoop
    from railui.planning.decision import Decision
    from railui.planning.next_run import NextRun

MAX_ROWS: Final = 12  # next runs shown
ALL: Final = "all"  # components


@dataclass(frozen=True)
class Candidates:
    """Options of the runs that may be made.

    Attributes
    ----------
    sensors
        File of the sensors that may be mounted.
    noise
        Noise in place of the file's, by column.
    loads
        Load states; that of a measured run.
    bench
        `all`, or the location of a measured component, such as primary_lateral or primary_lateral.2.
    """

    sensors: str | None
    speeds: list[float] | None
    tracks: Sequence[str]
    sections: int
    duration: float | None
    noise: Mapping[str, str]
    loads: tuple[str, ...]
    bench: str | None


def plan_after(directory: str, candidates: Candidates, measured: str | None, call: Invocation) -> None:
    """Rank the next runs after a loop, or compare its rivals on one that has been measured."""
    from railui.planning.after import load_finished_loop
    from railui.planning.rivals import undecided
    from railui.report.loop.next_run import rival_text, run_row

    loop = load_finished_loop(directory, seed=call.seed or 0, jobs=call.jobs, progress=StatusLine(call))
    structure = loop.context.campaign.design.structure
    rivals = [r.key | {"z": r.z} for r in loop.rivals]
    names = [rival_text(r, structure) for r in rivals]
    settings = loop.context.settings.planning
    open_ones = len(undecided(loop.rivals, settings))
    body: dict[str, Any] = {"after": directory, "rivals": rivals, "undecided": open_ones - 1}
    inputs = [str(loop.directory / "loop.json"), str(loop.context.campaign.source)]
    against = [(n, f"{r['z']:.2f}") for n, r in zip(names[1:], rivals[1:], strict=True)]
    caption = f"above {settings.critical_z:.2f}: separated by the data of the loop"
    call.show(make_table(("model", "z of the final model"), [(names[0], "final"), *against], caption=caption))
    if measured is not None:
        decisions = _decide(loop, measured, candidates, call)
        call.show(_decision_table(decisions, names, measured))
        body["decisions"] = [{"rival": d.rival, "z": d.z, "clear": d.is_clear} for d in decisions]
        call.write_json(call.document("plan", body, [*inputs, measured]))
        return
    if open_ones < 2:
        call.show("The data of the loop separate the final model from all others: no further run is needed for that.")
    found = _propose(loop, candidates) if open_ones > 1 else []
    rows = [run_row(run, structure) for run in found]
    body["next_runs"] = rows
    if found:
        call.show(_run_table(found, rows, names[1:open_ones]))
    call.write_json(call.document("plan", body, inputs))


def _propose(loop: FinishedLoop, candidates: Candidates) -> list[NextRun]:
    from railui.planning.after import propose_runs
    from railui.planning.plan_file import load_plan

    levels: dict[str, float] = {}
    if candidates.sensors is not None:
        levels = load_plan(candidates.sensors, loop.context.campaign.design, candidates.noise).noise_levels
    if candidates.bench not in (None, ALL):
        raise usage_error(f"--bench {candidates.bench} is for --measured: `--bench all` proposes benches")
    with usage_errors():
        return propose_runs(
            loop,
            candidates.speeds,
            list(candidates.tracks) or None,
            candidates.duration,
            levels,
            candidates.sections,
            candidates.loads,
            candidates.bench == ALL,
        )


def _run_table(found: Sequence[NextRun], rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> Any:
    """Return the table of the best runs: the chance that each decides, and that against every rival."""
    from railui.report.loop.next_run import prospect_cells

    lines = [
        (
            row["name"],
            f"{row['duration']:.0f} s",
            " ".join(r.sensors),
            f"{100 * r.probability:.0f} %",
            *prospect_cells(row, len(names), missing="-"),
        )
        for r, row in zip(found[:MAX_ROWS], rows, strict=False)
    ]
    same = [names[p.rival - 1] for p in found[0].prospects if p.is_equivalent]
    caption = (
        f"no such run separates the final model from: {', '.join(same)}; they predict the same motion" if same else None
    )
    columns = ("run", "duration", "sensors", "decides", *names)
    return make_table(columns, lines, title="next runs, the best first", caption=caption)


def _decide(loop: FinishedLoop, measured: str, candidates: Candidates, call: Invocation) -> list[Decision]:
    """Compare all rivals on a measured run of the vehicle, or of a component on a bench."""
    from railui.campaign.dataset import segments_of_run
    from railui.planning.decision import decide
    from railui.runs.run import load_run

    if len(candidates.loads) > 1:
        raise usage_error("a measured run has one load state: give --load once")
    kind = loop.context.campaign.design.run_form if candidates.bench is None else "bench"
    run = load_run(Path(measured), kind)
    call.warn(run.warnings)
    segments = segments_of_run(run, Path(measured).name, "test", kind)
    with usage_errors():
        if candidates.bench is None:
            load = candidates.loads[0] if candidates.loads else None
            return decide(loop.context, [r.in_load_state(load) for r in loop.rivals], segments)
        from railui.planning.component_bench import component, decide_bench

        return decide_bench(loop.context, loop.rivals, component(loop.rivals[0].model, candidates.bench), segments)


def _decision_table(decisions: Sequence[Decision], names: Sequence[str], measured: str) -> Any:
    rows = [
        (names[d.rival], f"{d.z:.2f}", (names[0] if d.z > 0 else names[d.rival]) if d.is_clear else "undecided")
        for d in decisions
    ]
    return make_table(("final model against", "z", "better on the run (5 % level)"), rows, title=measured)
