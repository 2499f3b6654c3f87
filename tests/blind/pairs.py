"""Cases with two effects compared with the oracle: gain of the second effect, and whether the loop finds it.

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
from railui.identification.context import create_context
from railui.identification.estimation.validation import is_significant_gain
from railui.identification.loop import close_loop
from tests.blind.assessment import assess, truth_of, validate_true_effects
from tests.blind.cases import PlantedCase, draw_cases
from tests.truth.campaign import campaign, write

CASES_PER_TRIAL = 20  # of which three have two effects
HEAD = (
    f"{'no':>5s} {'planted':58s} {'nuisance':10s} before better  both other gains     counts "
    " after floor name   cpu  named"
)


def compare_pair(case: PlantedCase, directory: Path) -> str:
    """Fit the true effects singly and together, run the loop and format the row of the table.

    better: error with the better one of the two; other gains: share of its square that the other one removes, with its
    standard error; counts: whether that changes the verdict. Raises ArithmeticError if every vehicle derails.
    """
    simulated = campaign(case.order)
    write(simulated, directory)
    truth = truth_of(case, simulated)
    context = create_context(read_dataset(load_campaign(directory)), jobs=1)
    first, second = truth.effects
    both = validate_true_effects(context, [first, second], truth)
    alone = min((validate_true_effects(context, [e], truth) for e in (first, second)), key=lambda j: j.nrmse)
    gain, sd, _ = alone.error_reduction(both)
    counts = "yes" if is_significant_gain(context, alone, both) else "no"
    cpu_start = time.process_time()
    result = assess(case, close_loop(context.dataset, jobs=1))
    right = (
        "both" if result.right_name else "one" if counts == "no" and result.named in case.text.split(" + ") else "NO"
    )
    return (
        f"{case.order.seed:5d} {case.text:58.58s} {case.nuisance:10s} {result.before:6.3f} {alone.nrmse:6.3f} "
        f"{both.nrmse:5.3f} {gain:6.3f} +/- {sd:5.3f} {counts:>6s} {result.after:6.3f} {result.floor:5.3f} {right:4s} "
        f"{time.process_time() - cpu_start:5.0f}  {result.named}"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command result."""
    p = argparse.ArgumentParser(prog="python -m tests.blind.pairs", description=__doc__)
    p.add_argument("--seeds", type=int, nargs="+", required=True, help="seeds of trials as drawn by tests.blind.blind")
    p.add_argument("--seconds", type=float, nargs=2, default=(70.0, 45.0), help="length of both runs")
    options = p.parse_args(arguments)
    print(HEAD, flush=True)
    for seed in options.seeds:
        for case in draw_cases(CASES_PER_TRIAL, seed, tuple(options.seconds)):
            if case.sort == "two":
                with tempfile.TemporaryDirectory() as directory:
                    print(compare_pair(case, Path(directory)), flush=True)


if __name__ == "__main__":
    main()
