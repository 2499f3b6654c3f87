"""Intervals and false alarms over realisations of the noise, on the coaches of a trial without an effect.

In a trial the parameters of a campaign share its noise: some ten intervals contain the truth, or miss it, together.
Here vehicle, track and motion of a campaign stay, and sensors and recorder of the track have other noise each time. An
unmeasured force would stay as well: campaigns with one are left out.

python -m tests.blind.realisations --seed 101000 --realisations 20
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.loop import close_loop
from tests.blind.coach_cases import CoachCase, draw_coaches
from tests.blind.processes import process_pool
from tests.blind.table import NORMAL_QUANTILE_95, bootstrap_limits
from tests.truth.coach_campaign import drawn, true_values, write_campaigns

HEAD = "| campaign | sensors | noise | false alarms | significant | intervals with the true value | % | 95 % limits |"
RULE = "| ---: | --- | --- | ---: | ---: | ---: | ---: | ---: |"


class Outcome(NamedTuple):
    """Result of a loop: its verdict, p of the first score test, and errors over standard deviations [parameter]."""

    verdict: str
    p: float
    scores: FloatArray


def coaches_without_effect(seed: int, seconds: Sequence[float]) -> list[CoachCase]:
    """Select the campaigns of a trial with neither an effect nor an unmeasured force."""
    return [c for c in draw_coaches(seed, seconds) if c.sort == "nothing" and not c.order.unmeasured]


def write_realisations(case: CoachCase, count: int, directory: Path) -> list[Path]:
    """Simulate a campaign so often, each time with other noise, and return the folders."""
    orders = [replace(case.order, realisation=k) for k in range(count)]
    folders = [directory / f"{case.order.seed}_{k}" for k in range(count)]
    write_campaigns(orders, folders)
    return folders


def run(case: CoachCase, folder: Path) -> Outcome:
    """Run the loop on a campaign; a model with a false effect has no scores."""
    result = close_loop(read_dataset(load_campaign(folder)), jobs=1)
    true, fit = true_values(drawn(case.order)), result.after
    estimates = zip(fit.free.paths, fit.x, fit.sd, strict=True)
    scores = [(x - true[p]) / sd for p, x, sd in estimates if p in true and sd > 0]
    return Outcome(result.verdict, result.steps[0].score_test.p, np.array(scores if result.verdict == "none" else []))


def row(names: Sequence[str], outcomes: Sequence[Outcome]) -> str:
    """Format a line of the table; the limits are those of a bootstrap over the realisations."""
    level = LoopSettings().score_test.significance_level
    inside = [np.abs(o.scores) <= NORMAL_QUANTILE_95 for o in outcomes if o.scores.size]
    counts = np.array([(x.sum(), x.size) for x in inside] or [(0, 0)])
    right, of = counts.sum(axis=0)
    alarms, significant = sum(o.verdict != "none" for o in outcomes), sum(o.p <= level for o in outcomes)
    cells = [*names, f"{alarms} of {len(outcomes)}", f"{significant} of {len(outcomes)}", f"{right} of {of}"]
    if of:
        low, high = bootstrap_limits(counts)
        cells += [f"{100 * right / of:.0f}", f"{100 * low:.0f} to {100 * high:.0f}"]
    return f"| {' | '.join(cells)} |"


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    p = argparse.ArgumentParser(prog="python -m tests.blind.realisations", description=__doc__)
    p.add_argument("--seed", type=int, default=101000, help="of the trial of coaches")
    p.add_argument("--realisations", type=int, default=20)
    p.add_argument("--campaigns", type=int, help="the first so many without an effect")
    p.add_argument("--seconds", type=float, nargs=2, default=(40.0, 30.0), help="length of both runs")
    p.add_argument("--processes", type=int, default=2, choices=(1, 2))
    options = p.parse_args(arguments)
    print(HEAD, RULE, sep="\n", flush=True)
    every: list[Outcome] = []
    with tempfile.TemporaryDirectory() as scratch, process_pool(options.processes) as pool:
        for case in coaches_without_effect(options.seed, options.seconds)[: options.campaigns]:
            folders = write_realisations(case, options.realisations, Path(scratch))
            outcomes = list(pool.map(partial(run, case), folders))
            every += outcomes
            print(row((str(case.order.seed), case.sensors, case.nuisance or "as stated"), outcomes), flush=True)
    print(row(("all", "", ""), every))


if __name__ == "__main__":
    main()
