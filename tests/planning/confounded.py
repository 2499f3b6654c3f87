"""Trial of the next run: campaigns that leave rivals, the run that is proposed, and one by chance.

python -m tests.planning.confounded --seed 83000 --cases 30 -o next.csv

Short campaigns of few sensors by chance are identified until enough leave undecided rivals, the planted effect among
them, which do not all predict the same motion. The measurements that may be made are runs at five speeds on a smooth, a
usual and a rough section of line, with the same sensors or one more, empty or laden, and any component on a bench. The
proposed one and one by chance (its kind first, then one of this kind) are simulated with the true vehicle by the
independent generator; Vuong's test on the predictions decides.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.context import Context
from railui.identification.loop import close_loop
from railui.planning.after import with_noise
from railui.planning.component_bench import benches_at, component_ports
from railui.planning.next_run import NextRun, next_runs
from railui.planning.planned_runs import PlannedRun, planned_runs
from railui.planning.rivals import RivalModel, rival_models, undecided
from tests.blind.cases import library_entries, planted_effect
from tests.blind.table import format_total
from tests.planning.measured import LADEN, Case, kind_of, laden_design, measure
from tests.trial_rows import append_rows, read_rows
from tests.truth.campaign import RESPONSES, Campaign, Order, campaign, write
from tests.truth.files import NOISE

SENSORS = (("ayf",), ("ayf", "rf"), ("ay1", "ayf"), ("rf", "d1"), ("ay1", "ay2", "ayf", "rf"))
SECONDS = (25.0, 20.0)
SPEEDS = (20.0, 25.0, 30.0, 35.0, 40.0)
TRACK = "erri_b176_low"
SECTIONS = (0.5, 1.0, 1.6)  # amplitudes of the track over those of the campaign; 1.6: erri_b176_high
DURATIONS = (12.0, 30.0)  # s of the next run
MAX_TRIES = 12  # campaigns per case
LIKELY = 0.7  # promised chance


@dataclass(frozen=True)
class Row:
    """One confounded case with runs of one duration [s]: rivals, the proposed run and one by chance, what they decide.

    `equivalent`: campaigns drawn before whose undecided rivals all predicted the same motion.
    """

    seed: int
    duration: float
    planted: str
    sensors: str
    rivals: str
    kind: str
    proposed: str
    promised: float
    decides: bool
    misleads: bool
    chance_kind: str
    by_chance: str
    chance_promised: float
    chance_decides: bool
    chance_misleads: bool
    campaigns: int
    equivalent: int
    seconds: float


def run_case(seed: int) -> list[Row]:
    """Draw campaigns until one is confounded, and try the proposed run and one by chance; nothing where none is."""
    rng = np.random.default_rng([seed, 61])
    started = time.perf_counter()
    equivalent = 0
    for k in range(MAX_TRIES):
        with tempfile.TemporaryDirectory() as scratch:
            found = _confounded(seed * 100 + k, rng, Path(scratch))
            if found is not None:
                context, truth, rivals = found
                rows = _try_runs(context, truth, rivals, rng, Path(scratch))
                if rows:
                    counts = {"campaigns": k + 1, "equivalent": equivalent}
                    return [replace(row, seed=seed, **counts, seconds=time.perf_counter() - started) for row in rows]
                equivalent += 1
    return []


def _confounded(seed: int, rng: np.random.Generator, folder: Path) -> tuple[Context, Campaign, list[RivalModel]] | None:
    """Identify a campaign by chance; return it where undecided rivals contain the planted effect, which then leads."""
    entries = [e for e in library_entries() if not e[0].startswith("sensor") and e[0] not in ("run_out", "coach_mode")]
    entry = entries[int(rng.integers(len(entries)))]
    planted = planted_effect(entry, float(rng.uniform(-1.0, 0.5)))
    sensors = SENSORS[int(rng.integers(len(SENSORS)))]
    order = Order(effects=(planted,), seed=seed, seconds=SECONDS, without=[c for c in RESPONSES if c not in sensors])
    try:
        truth = campaign(order)
        write(truth, folder)
        laden_design(folder, order.declared)
        result = close_loop(read_dataset(load_campaign(folder)), jobs=1)
    except (ArithmeticError, ValueError):
        return None
    rivals = undecided(rival_models(result), result.context.settings.planning)
    true = [i for i, r in enumerate(rivals) if tuple(r.key.values()) == entry]
    if len(rivals) < 2 or not true:
        return None
    return result.context, truth, [rivals[true[0]], *(r for i, r in enumerate(rivals) if i != true[0])]


def _try_runs(
    context: Context, truth: Campaign, rivals: list[RivalModel], rng: np.random.Generator, folder: Path
) -> list[Row]:
    """Assess the measurements of every duration and make two; nothing where all rivals are equivalent to the true."""
    sensors = context.dataset.segments[0].channels
    context = with_noise(context, {c: NOISE[c][0] for c in RESPONSES})
    line = [f"{TRACK} scale={scale:g} seed={int(rng.integers(10**6))}" for scale in SECTIONS]
    assessed = {s: _assess(context, rivals, sensors, line, s) for s in DURATIONS}
    longest = assessed[max(DURATIONS)]
    equivalent = {p.rival for p in longest[0].prospects if p.is_equivalent} if longest else set()
    if not all(assessed.values()) or len(equivalent) == len(rivals) - 1:
        return []
    case = Case(context, truth, [r for i, r in enumerate(rivals) if i not in equivalent])
    others = "; ".join(_name(r) + " (equivalent)" * (i in equivalent) for i, r in enumerate(rivals) if i > 0)
    return [
        _row(case, duration, " ".join(sensors), others, found, _by_chance(found, len(sensors), rng), folder)
        for duration, found in assessed.items()
    ]


def _assess(
    context: Context, rivals: list[RivalModel], sensors: Sequence[str], line: Sequence[str], duration: float
) -> list[NextRun]:
    """Assess all measurements that may be made, the best first.

    The ranking takes every rival as true in turn: that the planted one leads does not inform it.
    """
    more = [c for c in RESPONSES if c not in sensors]
    runs = [*planned_runs(SPEEDS, line, duration), *planned_runs(SPEEDS, line, duration, loads=[LADEN])]
    model = rivals[0].model
    return next_runs(context, rivals, runs, sensors, more, benches_at(context, model, component_ports(model)))


def _by_chance(found: Sequence[NextRun], sensors: int, rng: np.random.Generator) -> NextRun:
    """Draw a kind of measurement, then one of this kind."""
    kinds = sorted({kind_of(run, sensors) for run in found})
    kind = kinds[int(rng.integers(len(kinds)))]
    members = [run for run in found if kind_of(run, sensors) == kind]
    return members[int(rng.integers(len(members)))]


def _row(
    case: Case, duration: float, sensors: str, others: str, found: Sequence[NextRun], other: NextRun, folder: Path
) -> Row:
    """Make the proposed measurement and one by chance."""
    proposed = found[0]
    decides, misleads = measure(case, proposed, folder / f"a{duration:g}")
    chance_decides, chance_misleads = measure(case, other, folder / f"b{duration:g}")
    count = len(sensors.split())
    return Row(
        seed=0,
        duration=duration,
        planted=_name(case.rivals[0]),
        sensors=sensors,
        rivals=others,
        kind=kind_of(proposed, count),
        proposed=_text(proposed),
        promised=proposed.probability,
        decides=decides,
        misleads=misleads,
        chance_kind=kind_of(other, count),
        by_chance=_text(other),
        chance_promised=other.probability,
        chance_decides=chance_decides,
        chance_misleads=chance_misleads,
        campaigns=0,
        equivalent=0,
        seconds=0.0,
    )


def _name(rival: RivalModel) -> str:
    return " ".join(str(x) for x in rival.key.values() if x is not None) or "no effect"


def _text(found: NextRun) -> str:
    run = found.run
    name = run.name if isinstance(run, PlannedRun) else f"{run.at}.{run.port}" if run.port else run.at
    return f"{name} {' '.join(found.sensors)}"


def totals(rows: Sequence[Row]) -> list[str]:
    """Format how often each run decides."""
    cases = [r for r in rows if r.duration == max(DURATIONS)]
    drawn, equivalent = sum(r.campaigns for r in cases), sum(r.equivalent for r in cases)
    lines = ["| outcome | count | % | 95 % limits |", "| --- | ---: | ---: | ---: |"]
    for duration in DURATIONS:
        lines += _totals_of(f"{duration:g} s", [r for r in rows if r.duration == duration])
    for kind in sorted({r.chance_kind for r in rows}):
        by_chance = [r.chance_decides for r in rows if r.chance_kind == kind]
        proposed = [r.decides for r in rows if r.kind == kind]
        lines.append(format_total(f"both durations, {kind}: one by chance decides", by_chance))
        lines += [format_total(f"both durations, {kind}: proposed one decides", proposed)] if proposed else []
    likely = [r for r in rows if r.promised >= LIKELY]
    lines += [
        format_total(f"proposed runs predicted at {100 * LIKELY:.0f} % or more: decide", [r.decides for r in likely]),
        "",
        f"{drawn} campaigns were drawn for the {len(cases)} cases; in {equivalent} of them all rivals were equivalent "
        "to the planted effect.",
    ]
    return lines


def _totals_of(name: str, rows: Sequence[Row]) -> list[str]:
    promised = [100 * np.mean([getattr(r, key) for r in rows]) for key in ("promised", "chance_promised")]
    return [
        format_total(f"{name}: proposed run decides (predicted {promised[0]:.0f} %)", [r.decides for r in rows]),
        format_total(
            f"{name}: one by chance decides (predicted {promised[1]:.0f} %)", [r.chance_decides for r in rows]
        ),
        format_total(f"{name}: proposed run decides for another", [r.misleads for r in rows]),
        format_total(f"{name}: one by chance decides for another", [r.chance_misleads for r in rows]),
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    p = argparse.ArgumentParser(prog="python -m tests.planning.confounded", description=__doc__)
    p.add_argument("--seed", type=int, default=83000)
    p.add_argument("--cases", type=int, default=30)
    p.add_argument("--processes", type=int, default=2, choices=(1, 2))
    p.add_argument("-o", "--output", type=Path, metavar="CSV", help="append each row; present ones are not repeated")
    options = p.parse_args(arguments)
    rows: list[Row] = read_rows(options.output, Row) if options.output else []
    done = {row.seed for row in rows}
    seeds = [s for s in range(options.seed, options.seed + options.cases) if s not in done]
    with multiprocessing.get_context("spawn").Pool(options.processes) as pool:
        for found in pool.imap_unordered(run_case, seeds):
            print(*found, sep="\n", flush=True)
            rows += found
            if options.output and found:
                append_rows(options.output, found)
    print("\n".join(totals(rows)))


if __name__ == "__main__":
    main()
