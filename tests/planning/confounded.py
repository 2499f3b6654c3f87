"""Trial of the next run: campaigns that leave rivals, the run that is proposed, and one by chance.

python -m tests.planning.confounded --seed 81000 --cases 30 -o next.csv --write docs/plan.md

Short campaigns of few sensors by chance are identified until enough leave undecided rivals, the planted effect among
them, which do not all predict the same motion. The runs that may be made are those of five speeds on a smooth, a usual
and a rough section of line, with the same sensors or one more. The proposed run and one of these by chance are
simulated with the true vehicle by the independent generator; Vuong's test on the predictions decides.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset, segments_of_run
from railui.campaign.noise.model import NoiseModel, as_noise_model, white_noise
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.loop import close_loop
from railui.planning.decision import decide
from railui.planning.next_run import NextRun, next_runs
from railui.planning.planned_runs import planned_runs
from railui.planning.rivals import RivalModel, rival_models, undecided
from railui.runs.run import load_run
from railui.track import parse_spec
from tests.blind.cases import library_entries, planted_effect
from tests.blind.table import format_total
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
    proposed: str
    promised: float
    decides: bool
    misleads: bool
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
    """Assess the runs of every duration and make two of them; nothing where all rivals are equivalent to the true."""
    sensors = context.dataset.segments[0].channels
    more = [c for c in RESPONSES if c not in sensors]
    levels = white_noise({c: NOISE[c][0] for c in more})
    noise = NoiseModel({**as_noise_model(context.noise).columns, **levels.columns})
    context = replace(context, dataset=replace(context.dataset, noise=noise))
    line = [f"{TRACK} scale={scale:g} seed={int(rng.integers(10**6))}" for scale in SECTIONS]
    # the ranking takes every rival as true in turn: that the planted one leads tells it nothing
    assessed = {s: next_runs(context, rivals, planned_runs(SPEEDS, line, s), sensors, more) for s in DURATIONS}
    longest = assessed[max(DURATIONS)]
    equivalent = {p.rival for p in longest[0].prospects if p.is_equivalent} if longest else set()
    if not all(assessed.values()) or len(equivalent) == len(rivals) - 1:
        return []
    open_ones = [r for i, r in enumerate(rivals) if i not in equivalent]
    others = "; ".join(_name(r) + " (equivalent)" * (i in equivalent) for i, r in enumerate(rivals) if i > 0)
    rows = []
    for duration, found in assessed.items():
        proposed, other = found[0], found[int(rng.integers(len(found)))]
        made = (("a", proposed), ("b", other))
        (decides, misleads), (chance_decides, chance_misleads) = (
            _measure(context, truth, open_ones, run, folder / f"{name}{duration:g}") for name, run in made
        )
        rows.append(
            Row(
                seed=0,
                duration=duration,
                planted=_name(rivals[0]),
                sensors=" ".join(sensors),
                rivals=others,
                proposed=_text(proposed),
                promised=proposed.probability,
                decides=decides,
                misleads=misleads,
                by_chance=_text(other),
                chance_promised=other.probability,
                chance_decides=chance_decides,
                chance_misleads=chance_misleads,
                campaigns=0,
                equivalent=0,
                seconds=0.0,
            )
        )
    return rows


def _name(rival: RivalModel) -> str:
    return " ".join(str(x) for x in rival.key.values() if x is not None) or "no effect"


def _text(run: NextRun) -> str:
    return f"{run.run.name} {' '.join(run.sensors)}"


def _measure(
    context: Context, truth: Campaign, rivals: Sequence[RivalModel], run: NextRun, folder: Path
) -> tuple[bool, bool]:
    """Simulate a run with the true vehicle; return whether it decides for the true rival, and for a wrong one.

    A vehicle that leaves the track decides nothing.
    """
    order = replace(
        truth.order,
        seed=truth.order.seed + 7,
        scale=parse_spec(run.run.source.name).scale,
        speeds=(run.run.speed, run.run.speed),
        seconds=(run.run.duration, 10.0),
        without=[c for c in RESPONSES if c not in run.sensors],
        vehicle=truth.vehicle,
    )
    try:
        write(campaign(order), folder)
    except ArithmeticError:
        return False, False
    segments: list[Segment] = segments_of_run(load_run(folder / "run_a.csv.gz"), "run_a.csv.gz", "test")
    decisions = decide(context, rivals, segments)
    return all(d.is_clear and d.z > 0 for d in decisions), any(d.is_clear and d.z < 0 for d in decisions)


def totals(rows: Sequence[Row]) -> list[str]:
    """Format how often each run decides."""
    cases = [r for r in rows if r.duration == max(DURATIONS)]
    drawn, equivalent = sum(r.campaigns for r in cases), sum(r.equivalent for r in cases)
    lines = ["| outcome | count | % | 95 % limits |", "| --- | ---: | ---: | ---: |"]
    for duration in DURATIONS:
        lines += _totals_of(f"{duration:g} s", [r for r in rows if r.duration == duration])
    likely = [r for r in rows if r.promised >= LIKELY]
    lines += [
        format_total(f"proposed runs promised at {100 * LIKELY:.0f} % or more: decide", [r.decides for r in likely]),
        "",
        f"{drawn} campaigns were drawn for the {len(cases)} cases; in {equivalent} of them all rivals were equivalent "
        "to the planted effect.",
    ]
    return lines


def _totals_of(name: str, rows: Sequence[Row]) -> list[str]:
    promised = [100 * np.mean([getattr(r, key) for r in rows]) for key in ("promised", "chance_promised")]
    return [
        format_total(f"{name}: proposed run decides (promised {promised[0]:.0f} %)", [r.decides for r in rows]),
        format_total(f"{name}: one by chance decides (promised {promised[1]:.0f} %)", [r.chance_decides for r in rows]),
        format_total(f"{name}: proposed run decides for another", [r.misleads for r in rows]),
        format_total(f"{name}: one by chance decides for another", [r.chance_misleads for r in rows]),
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    p = argparse.ArgumentParser(prog="python -m tests.planning.confounded", description=__doc__)
    p.add_argument("--seed", type=int, default=81000)
    p.add_argument("--cases", type=int, default=30)
    p.add_argument("--processes", type=int, default=2, choices=(1, 2))
    p.add_argument("-o", "--output", type=Path, metavar="CSV", help="append each row; present ones are not repeated")
    options = p.parse_args(arguments)
    rows: list[Row] = read_rows(options.output, Row) if options.output else []
    done = {row.seed for row in rows}
    seeds = [s for s in range(options.seed, options.seed + options.cases) if s not in done]
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(variable, "1")  # the processes inherit it
    with multiprocessing.get_context("spawn").Pool(options.processes) as pool:
        for found in pool.imap_unordered(run_case, seeds):
            print(*found, sep="\n", flush=True)
            rows += found
            if options.output and found:
                append_rows(options.output, found)
    print("\n".join(totals(rows)))


if __name__ == "__main__":
    main()
