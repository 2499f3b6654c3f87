"""Pairs held against the oracle of each: does the second effect gain enough to be named, and is it?

python -m tests.blind.pairs --seeds 3000 3100
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.loop import close_loop
from railui.identification.structure.stepwise import is_significant_gain
from tests.blind.answers import adjusted_truly, judged
from tests.blind.plants import Plant, drawn
from tests.truth.campaign import campaign, write

OF_A_TRIAL = 20  # campaigns, of which three are pairs
HEAD = (
    f"{'no':>5s} {'planted':58s} {'nuisance':10s} before better  both other gains     counts "
    " after floor name   cpu  named"
)


def row(plant: Plant, home: Path) -> str:
    """A line of the table: the true effects adjusted alone and together, and what the loop finds.

    better: error with that of the two which does better alone; other gains: share of its square that the other takes,
    with its standard error; counts: does that change a verdict? Raises ArithmeticError where every vehicle derails.
    """
    truth = campaign(plant.order)
    write(truth, home)
    measurement = read_dataset(load_campaign(home))
    first, second = truth.effects["a"][:2]
    both = adjusted_truly([first, second], truth, measurement)
    alone = min((adjusted_truly([e], truth, measurement) for e in (first, second)), key=lambda j: j.nrmse)
    gain, sd = alone.error_reduction(both)
    counts = "yes" if is_significant_gain(alone, both, measurement.campaign.material) else "no"
    busy = time.process_time()
    line = judged(plant, close_loop(measurement, jobs=1))
    right = "both" if line.right_name else "one" if counts == "no" and line.named in plant.text.split(" + ") else "NO"
    return (
        f"{plant.order.seed:5d} {plant.text:58.58s} {plant.nuisance:10s} {line.before:6.3f} {alone.nrmse:6.3f} "
        f"{both.nrmse:5.3f} {gain:6.3f} +/- {sd:5.3f} {counts:>6s} {line.after:6.3f} {line.floor:5.3f} {right:4s} "
        f"{time.process_time() - busy:5.0f}  {line.named}"
    )


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.blind.pairs", description=__doc__)
    p.add_argument("--seeds", type=int, nargs="+", required=True, help="of trials as tests.blind.blind draws them")
    p.add_argument("--seconds", type=float, nargs=2, default=(70.0, 45.0), help="length of both runs")
    given = p.parse_args(words)
    print(HEAD, flush=True)
    for seed in given.seeds:
        for plant in drawn(OF_A_TRIAL, seed, tuple(given.seconds)):
            if plant.sort == "two":
                with tempfile.TemporaryDirectory() as home:
                    print(row(plant, Path(home)), flush=True)


if __name__ == "__main__":
    main()
