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
DURATION = 30.0
MAX_TRIES = 12  # campaigns per case
LIKELY = 0.7  # promised chance


@dataclass(frozen=True)
class Row:
    """One confounded case: rivals, the proposed run and one by chance, and what each decides.

    `equivalent`: campaigns drawn before whose undecided rivals all predicted the same motion.
    """

    seed: int
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


def run_case(seed: int) -> Row | None:
    """Draw campaigns until one is confounded, and try the proposed run and one by chance; None where none is."""
    rng = np.random.default_rng([seed, 61])
    started = time.perf_counter()
    equivalent = 0
    for k in range(MAX_TRIES):
        with tempfile.TemporaryDirectory() as scratch:
            found = _confounded(seed * 100 + k, rng, Path(scratch))
            if found is not None:
                context, truth, rivals = found
                row = _try_runs(context, truth, rivals, rng, Path(scratch))
                if row is not None:
                    seconds = time.perf_counter() - started
                    return replace(row, seed=seed, campaigns=k + 1, equivalent=equivalent, seconds=seconds)
                equivalent += 1
    return None


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
) -> Row | None:
    """Assess the runs and make two of them; None where all rivals are equivalent to the planted effect."""
    sensors = context.dataset.segments[0].channels
    more = [c for c in RESPONSES if c not in sensors]
    levels = white_noise({c: NOISE[c][0] for c in more})
    noise = NoiseModel({**as_noise_model(context.noise).columns, **levels.columns})
    context = replace(context, dataset=replace(context.dataset, noise=noise))
    line = [f"{TRACK} scale={scale:g} seed={int(rng.integers(10**6))}" for scale in SECTIONS]
    # the ranking takes every rival as true in turn: that the planted one leads tells it nothing
    assessed = next_runs(context, rivals, planned_runs(SPEEDS, line, DURATION), sensors, more)
    equivalent = {p.rival for p in assessed[0].prospects if p.is_equivalent} if assessed else set()
    if not assessed or len(equivalent) == len(rivals) - 1:
        return None
    open_ones = [r for i, r in enumerate(rivals) if i not in equivalent]
    proposed, other = assessed[0], assessed[int(rng.integers(len(assessed)))]
    made = (("a", proposed), ("b", other))
    outcomes = [_measure(context, truth, open_ones, run, folder / name) for name, run in made]
    return Row(
        0,
        _name(rivals[0]),
        " ".join(sensors),
        "; ".join(_name(r) + " (equivalent)" * (i in equivalent) for i, r in enumerate(rivals) if i > 0),
        _text(proposed),
        proposed.probability,
        *outcomes[0],
        _text(other),
        other.probability,
        *outcomes[1],
        0,
        0,
        0.0,
    )


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
        seconds=(DURATION, 10.0),
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
    promised = np.mean([r.promised for r in rows]) if rows else float("nan")
    drawn, equivalent = sum(r.campaigns for r in rows), sum(r.equivalent for r in rows)
    lines = [
        "| outcome | count | % | 95 % limits |",
        "| --- | ---: | ---: | ---: |",
        format_total("proposed run decides for the planted effect", [r.decides for r in rows]),
        format_total("of those promised at 70 % or more", [r.decides for r in rows if r.promised >= LIKELY]),
        format_total("proposed run decides for another", [r.misleads for r in rows]),
        format_total("run by chance decides for the planted effect", [r.chance_decides for r in rows]),
        format_total("run by chance decides for another", [r.chance_misleads for r in rows]),
        "",
        f"Promised on average {100 * promised:.0f} % for the proposed runs, "
        f"{100 * np.mean([r.chance_promised for r in rows]):.0f} % for those by chance. {drawn} campaigns were drawn "
        f"for the {len(rows)} cases; in {equivalent} of them all rivals were equivalent to the planted effect.",
    ]
    return lines


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
        for row in pool.imap_unordered(run_case, seeds):
            if row is None:
                continue
            print(row, flush=True)
            rows.append(row)
            if options.output:
                append_rows(options.output, [row])
    print("\n".join(totals(rows)))


if __name__ == "__main__":
    main()
