"""Trial of plans: campaigns simulated as planned, and what the loop finds in them against what the plan predicted.

python -m tests.planning.trial --seed 71000 -o plans.csv --resume --write docs/plan.md

Every plan has campaigns with an effect of its minimum detectable size and campaigns without one. The vehicles of the
independent generator differ from the nominal vehicle that the plan knows, and run on tracks of the same spectrum.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.context import create_context
from railui.identification.loop import close_loop
from railui.planning.expectation import Choice, Expectation
from railui.planning.information import collect_information
from railui.planning.plan import expect
from railui.planning.plan_file import load_plan
from railui.planning.planned_runs import planned_runs, simulate_runs
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model
from tests.bench.page import write_after
from tests.blind.assessment import assess, truth_of
from tests.blind.cases import DETECTABLE_PARAMETERS, PlantedCase, with_detectable_effect
from tests.blind.draw import PRIOR_SPREAD
from tests.blind.table import format_total
from tests.trial_rows import append_rows, read_rows
from tests.truth.campaign import DECLARED, RESPONSES, Order, campaign, write
from tests.truth.files import NOISE, design

TRACK = "erri_b176_low"
NORMAL_MEDIAN = 0.6745  # of the absolute value of a standard normal variable


@dataclass(frozen=True)
class PlannedCampaign:
    """Sensors and runs of a planned campaign; the last speed [m/s] is that of the validation run of 60 s."""

    sensors: tuple[str, ...]
    speeds: tuple[float, ...]
    seconds: float = 60.0


PLANS = (
    PlannedCampaign(RESPONSES, (40.0, 31.0)),
    PlannedCampaign(("ayf", "rf"), (38.0, 30.0)),
    PlannedCampaign(("ay1", "ay2", "ayf", "rf"), (40.0, 35.0, 25.0)),
    PlannedCampaign(("rf", "d1", "d2"), (35.0, 40.0)),
    PlannedCampaign(("ay1", "ay2", "ayf"), (40.0, 30.0)),
)


@dataclass(frozen=True)
class Row:
    """One campaign: what was planted, what the loop found, errors of the parameters over their promised deviation."""

    number: int
    plan: int
    planted: str
    verdict: str
    is_right: bool
    after: float
    floor: float
    promised_floor: float
    z: str  # path=error over the promised standard deviation, of campaigns without an effect
    seconds: float


def expectation(plan: PlannedCampaign, folder: Path, seed: int) -> Expectation:
    """Return what a plan promises."""
    (folder / "vehicle.yaml").write_text(design(DECLARED))
    noise = {c: NOISE[c][1] for c in ("yw", "phiw", "gauge", *plan.sensors)}
    (folder / "plan.yaml").write_text("noise: {" + ", ".join(f"{c}: {x}" for c, x in noise.items()) + "}\n")
    file = load_plan(folder / "plan.yaml", load_design(folder / "vehicle.yaml"))
    runs = planned_runs(plan.speeds, [f"{TRACK} seed={seed}"], plan.seconds)
    dataset = simulate_runs(file.campaign, Model(file.campaign.design), runs, file.sensors)
    information = collect_information(create_context(dataset, seed=seed, jobs=1))
    last = len(runs) - 1
    return expect(information, Choice(file.sensors, tuple(range(last)), last), file.campaign, seed)


Job = tuple[int, int, int, int, float]  # plan, seed, campaigns with and without an effect, multiple of its limit


def run_plan(job: Job) -> list[Row]:
    """Simulate the campaigns of a plan and close the loop on each."""
    number, seed, planted, clean, factor = job
    plan = PLANS[number]
    with tempfile.TemporaryDirectory() as scratch:
        promised = expectation(plan, Path(scratch), seed)
        rows = [r for r in promised.detectable() if (r["kind"], r["at"]) in DETECTABLE_PARAMETERS and r["value"]]
        rng = np.random.default_rng([seed, 5])
        order = Order(
            seed=seed,
            speeds=plan.speeds,
            seconds=(plan.seconds,) * len(plan.speeds),
            without=[c for c in RESPONSES if c not in plan.sensors],
            spread=PRIOR_SPREAD,
        )
        found = []
        for k in range(planted + clean):
            mine = Order(**{**vars(order), "seed": seed + k, "name": f"plan {number} {k}"})
            case = PlantedCase("nothing", (), mine)
            if k < planted:
                case = with_detectable_effect(case, rows[int(rng.integers(len(rows)))], factor)
            found.append(_run(case, number, promised, Path(scratch) / str(k)))
    return found


def _run(case: PlantedCase, plan: int, promised: Expectation, folder: Path) -> Row:
    started = time.perf_counter()
    try:
        truth = campaign(case.order)
        write(truth, folder)
        result = close_loop(read_dataset(load_campaign(folder)), jobs=1)
    except (ArithmeticError, ValueError) as error:
        return Row(case.order.seed, plan, case.text, f"exception: {error}", False, *[float("nan")] * 3, "", 0.0)
    assessed = assess(case, result)
    z = ""
    if not case.effects and result.verdict == "none":
        true = truth_of(case, truth).values
        free, sd = (
            promised.information.free,
            dict(zip(promised.information.free.paths, promised.parameter_sd, strict=True)),
        )
        found = dict(zip(result.after.free.paths, result.after.x, strict=True))
        z = " ".join(f"{p}={(found[p] - true[p]) / sd[p]:.3f}" for p in free.paths if p in true and p in found)
    return Row(
        case.order.seed,
        plan,
        case.text,
        result.verdict,
        bool(assessed.right_class),
        assessed.after,
        assessed.floor,
        promised.noise_floor,
        z,
        time.perf_counter() - started,
    )


def scores(rows: Sequence[Row]) -> Mapping[str, list[float]]:
    """Errors of the estimates over the promised standard deviation, by path."""
    found: dict[str, list[float]] = {}
    for row in rows:
        for word in row.z.split():
            path, value = word.split("=")
            found.setdefault(path, []).append(float(value))
    return found


def totals(rows: Sequence[Row]) -> list[str]:
    """Format what was promised and what was found; campaigns that cannot be simulated are left out."""
    rows = [r for r in rows if not r.verdict.startswith("exception")]
    planted = [r for r in rows if r.planted and not r.planted.startswith("nothing")]
    clean = [r for r in rows if r not in planted]
    z = scores(rows)
    every = np.concatenate([np.array(x) for x in z.values()]) if z else np.zeros(0)
    lines = [
        "| outcome | count | % | 95 % limits |",
        "| --- | ---: | ---: | ---: |",
        format_total("effect of the predicted minimum size: found, class and location", [r.is_right for r in planted]),
        format_total("the same: any verdict but `none`", [r.verdict != "none" for r in planted]),
        format_total("no effect: false alarm", [r.verdict != "none" for r in clean]),
    ]
    for i in sorted({r.plan for r in rows}):
        of_plan = [r.is_right for r in planted if r.plan == i]
        plan = PLANS[i]
        name = "all sensors" if plan.sensors == RESPONSES else " ".join(plan.sensors)
        speeds = ", ".join(f"{v:g}" for v in plan.speeds)
        lines.append(format_total(f"{name}; {speeds} m/s: found", of_plan))
    if every.size:
        rms, median = np.sqrt(np.mean(every**2)), np.median(np.abs(every)) / NORMAL_MEDIAN
        counted = f"Errors of {len(z)} parameters over their predicted standard deviation, {len(clean)} campaigns"
        lines += ["", f"{counted}: rms {rms:.2f}, median of abs {median:.2f} (1 where the prediction is right)."]
        lines += ["", "| parameter | rms | 95 % limits |", "| --- | ---: | ---: |"]
        lines += [_rms_line(path, np.array(x)) for path, x in z.items()]
    ratio = np.array([r.floor / r.promised_floor for r in rows if np.isfinite(r.floor)])
    if ratio.size:
        lines += ["", f"Noise floor found over the predicted one: {ratio.min():.2f} to {ratio.max():.2f}, "
                      f"median {np.median(ratio):.2f}."]  # fmt: skip
    return lines


def _rms_line(path: str, z: NDArray[np.float64]) -> str:
    """Format the rms of scores with its limits by the chi-squared distribution."""
    rms = np.sqrt(np.mean(z**2))
    low, high = np.sqrt(len(z) / stats.chi2.ppf([0.975, 0.025], len(z)))
    return f"| {path} | {rms:.2f} | {low * rms:.2f} to {high * rms:.2f} |"


def run_trial(jobs: Sequence[Job], processes: int) -> Iterator[list[Row]]:
    """Run parts of plans in processes and yield their rows."""
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        yield from pool.imap_unordered(run_plan, jobs)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    p = argparse.ArgumentParser(prog="python -m tests.planning.trial", description=__doc__)
    p.add_argument("--seed", type=int, default=71000)
    p.add_argument("--parts", type=int, default=4, help="of every plan, each with a track of its own")
    p.add_argument("--planted", type=int, default=3, help="campaigns with an effect, per part")
    p.add_argument("--clean", type=int, default=2, help="campaigns without one, per part")
    p.add_argument("--factor", type=float, default=1.0, help="size of the effects over the predicted minimum")
    p.add_argument("--processes", type=int, default=2, choices=(1, 2))
    p.add_argument("-o", "--output", type=Path, metavar="CSV", help="append the rows of each part as it finishes")
    p.add_argument("--resume", action="store_true", help="leave out the parts that the output has")
    p.add_argument("--write", type=Path, metavar="MD", help="replace the section of the trial in a document")
    options = p.parse_args(arguments)
    rows: list[Row] = read_rows(options.output, Row) if options.resume and options.output else []
    done = {row.number for row in rows}
    size = options.planted + options.clean
    jobs = [
        (plan, options.seed + size * (len(PLANS) * part + plan), options.planted, options.clean, options.factor)
        for part in range(options.parts)
        for plan in range(len(PLANS))
    ]
    for found in run_trial([job for job in jobs if job[1] not in done], options.processes):
        for row in found:
            print(
                f"{row.number} {row.plan} {row.planted}: {row.verdict} {row.is_right} {row.seconds:.0f} s", flush=True
            )
        rows += found
        if options.output:
            append_rows(options.output, found)
    lines = totals(rows)
    print("\n".join(lines))
    if options.write:
        head = f"`python -m tests.planning.trial --seed {options.seed} --parts {options.parts}`:"
        write_after(options.write, "\n".join(["", head, "", *lines]))


if __name__ == "__main__":
    main()
