"""Coverage of the stated intervals over realisations of the noise, on the coaches of a trial without an effect.

In a trial the parameters of a campaign share its noise: some ten intervals contain the truth, or miss it, together.
Here vehicle, track and motion of a campaign stay, and sensors and recorder of the track have other noise each time.

python -m tests.blind.realisations --seed 101000 --realisations 20
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.loop import calibrate_only
from tests.blind.coach_cases import CoachCase, draw_coaches
from tests.blind.processes import process_pool
from tests.blind.table import NORMAL_QUANTILE_95
from tests.truth.coach_campaign import drawn, true_values, write_campaigns

HEAD = "| campaign | sensors | noise | intervals with the true value | % | rms of error over standard deviation |"
RULE = "| ---: | --- | --- | ---: | ---: | ---: |"


def coaches_without_effect(seed: int, seconds: Sequence[float]) -> list[CoachCase]:
    """Select the campaigns of a trial in which no effect is planted."""
    return [case for case in draw_coaches(seed, seconds) if case.sort == "nothing"]


def write_realisations(case: CoachCase, count: int, directory: Path) -> list[Path]:
    """Simulate a campaign so often, each time with other noise, and return the folders."""
    orders = [replace(case.order, realisation=k) for k in range(count)]
    folders = [directory / f"{case.order.seed}_{k}" for k in range(count)]
    write_campaigns(orders, folders)
    return folders


def scores_of(case: CoachCase, folder: Path) -> FloatArray:
    """Errors of the calibrated parameters over their standard deviations."""
    fit = calibrate_only(read_dataset(load_campaign(folder)), jobs=1).before
    true = true_values(drawn(case.order))
    return np.array([(x - true[p]) / sd for p, x, sd in zip(fit.free.paths, fit.x, fit.sd, strict=True) if p in true])


def row(campaign: str, sensors: str, noise: str, scores: FloatArray) -> str:
    """Format a line of the table for scores of any shape."""
    inside = np.abs(scores) <= NORMAL_QUANTILE_95
    rms = float(np.sqrt(np.mean(scores**2)))
    count = f"{inside.sum()} of {inside.size}"
    return f"| {campaign} | {sensors} | {noise} | {count} | {100 * inside.mean():.0f} | {rms:.2f} |"


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
    every = []
    with tempfile.TemporaryDirectory() as scratch, process_pool(options.processes) as pool:
        for case in coaches_without_effect(options.seed, options.seconds)[: options.campaigns]:
            folders = write_realisations(case, options.realisations, Path(scratch))
            every.append(np.array(list(pool.map(partial(scores_of, case), folders))))
            print(row(str(case.order.seed), case.sensors, case.nuisance or "as stated", every[-1]), flush=True)
    print(row("all", "", "", np.concatenate([scores.ravel() for scores in every])))


if __name__ == "__main__":
    main()
