"""Pareto fronts of the nominal and of the calibrated model, over several seeds of the search.

python -m tests.bench.purpose [CAMPAIGN] [--output DIR] [--seeds N] [--write PAGE]: the campaign is looped where its
calibrated design is not there yet. The study of the bundled campaign is searched with both vehicles and N seeds of the
search; all designs of all fronts are then simulated with the calibrated vehicle on tracks that no search used.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.execution.session import Session
from railui.execution.threads import ThreadRunner
from railui.optimisation.evaluation import evaluate_in_process
from railui.optimisation.fresh import evaluate_fresh
from railui.optimisation.optimise import optimise
from railui.optimisation.search import baseline_values
from railui.optimisation.study import Study
from railui.optimisation.study_reader import load_study
from railui.vehicle.design import Design
from railui.vehicle.design_reader import load_design

HOME = Path(__file__).parents[2]
CAMPAIGN = HOME / "designs/campaigns/worn_axle_box"
VEHICLES = ("nominal", "identified")
BEGIN, END = "<!-- purpose -->\n", "<!-- end of purpose -->"  # in the page
LEVELS = 4  # accelerations at which fronts are compared


def study_of(output: Path) -> Study:
    """The bundled study, on the calibrated vehicle of a loop in output/loop."""
    text = (HOME / "designs/studies/worn_axle_box.yaml").read_text("utf-8")
    line = next(line for line in text.splitlines() if line.startswith("vehicle:"))
    path = output / "study.yaml"
    path.write_text(text.replace(line, "vehicle: loop/adjusted.yaml"), "utf-8")
    return load_study(path)


def searched(study: Study, design: Design, seed: int, out: Path) -> FloatArray:
    """Designs [design, variable] on the front of a search with a vehicle and a seed, its evaluations kept."""
    method = replace(study.method, seed=seed)
    own = replace(study, design=design, method=method, name=f"{study.name}, {out.name}")
    with Session(own, out, ThreadRunner()) as session:
        result = optimise(own, evaluator=session.evaluator, progress=session.progress())
    return np.array([list(row["variables"].values()) for row in result["pareto"]])


def best_margin(acceleration: FloatArray, margin: FloatArray, level: float) -> float:
    """Largest margin of the designs whose acceleration is at most a level; NaN without any."""
    allowed = acceleration <= level
    return float(margin[allowed].max()) if np.any(allowed) else float("nan")


def compared(fresh: dict[tuple[str, int], FloatArray], seeds: Sequence[int]) -> Iterator[list[str]]:
    """Rows: acceleration, best margin of each vehicle's fronts (mean and sd over the seeds), their difference."""
    means = {key: values.mean(axis=0) for key, values in fresh.items()}
    lowest = max(float(x[:, 0].min()) for x in means.values())
    highest = min(float(x[:, 0].max()) for x in means.values())
    for level in [*np.linspace(lowest, max(highest, lowest), LEVELS), np.inf]:
        best = {v: np.array([best_margin(*means[v, s].T, level) for s in seeds]) for v in VEHICLES}
        difference = best["identified"].mean() - best["nominal"].mean()
        error = np.sqrt(sum(np.var(b, ddof=1) / len(b) for b in best.values()))
        cells = [f"{b.mean():.2f} ± {b.std(ddof=1):.2f}" for b in best.values()]
        largest = max(float(x[np.argmax(x[:, 1]), 0]) for x in means.values())  # acceleration of the largest margin
        label = f"{level:.4f}" if np.isfinite(level) else f"any, up to {largest:.4f}"
        yield [label, *cells, f"{difference:+.2f} ± {error:.2f}".replace("-", "−")]


def report(study: Study, fronts: dict[tuple[str, int], FloatArray], seeds: Sequence[int]) -> str:
    """The comparison as Markdown."""
    baseline = np.asarray(baseline_values(study))[None]
    x = np.vstack([baseline, *fronts.values()])
    evaluated = evaluate_fresh(study, x, evaluate_in_process()).objectives
    ends = np.cumsum([1, *(len(front) for front in fronts.values())])
    fresh = {key: evaluated[:, a:b] for key, a, b in zip(fronts, ends[:-1], ends[1:], strict=True)}
    noise = np.median([v.std(axis=0, ddof=1).mean(axis=0) / np.sqrt(len(v)) for v in fresh.values()], axis=0)
    rows = "\n".join("| " + " | ".join(row) + " |" for row in compared(fresh, seeds))
    as_is = evaluated[:, 0].mean(axis=0)
    yaw = next(i for i, v in enumerate(study.variables) if v.path.endswith("yaw_damping"))
    ranges = "; ".join(
        f"{v}: {1e-3 * min(fronts[v, s][:, yaw].min() for s in seeds):.0f} to "
        f"{1e-3 * max(fronts[v, s][:, yaw].max() for s in seeds):.0f}"
        for v in VEHICLES
    )
    head = "weighted acceleration at most, m/s^2", "margin, fronts of the nominal model", "of the identified model"
    designs = sum(map(len, fronts.values()))
    return f"""
{len(seeds)} searches with each vehicle (seeds {seeds[0]} to {seeds[-1]}); the {designs} designs of their fronts were
simulated with the identified vehicle on {len(evaluated)} sets of tracks that no search used. The vehicle as identified
has {as_is[0]:.4f} m/s^2 and a flange margin of {as_is[1]:.2f} sd.

| {" | ".join(head)} | difference |
| ---: | ---: | ---: | ---: |
{rows}

±: standard deviation over the searches, of the difference its standard error. Standard error of a design over the sets
of tracks: {noise[0]:.4f} m/s^2 and {noise[1]:.2f} sd. Yaw damping on the fronts, kN*m*s/rad: {ranges}.
"""


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("campaign", nargs="?", type=Path, default=CAMPAIGN)
    parser.add_argument("--output", type=Path, default=HOME / "railui-study/purpose")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--write", type=Path, help="page whose results are written anew")
    args = parser.parse_args()
    looped = args.output / "loop"
    if not (looped / "adjusted.yaml").exists():
        words = [sys.executable, "-m", "railui", "loop", str(args.campaign), "-o", str(looped), "-q"]
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    files = {"nominal": args.campaign / "vehicle.yaml", "identified": looped / "adjusted.yaml"}
    study, seeds = study_of(args.output), range(1, 1 + args.seeds)
    fronts: dict[tuple[str, int], Any] = {
        (name, seed): searched(study, load_design(file), seed, args.output / f"{name}_{seed}")
        for name, file in files.items()
        for seed in seeds
    }
    text = report(study, fronts, seeds)
    print(text)
    if args.write:
        before, _, rest = args.write.read_text("utf-8").partition(BEGIN)
        args.write.write_text(f"{before}{BEGIN}{text}{END}{rest.partition(END)[2]}", "utf-8")


if __name__ == "__main__":
    main()
