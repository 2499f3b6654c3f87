"""The optima of the nominal and of the calibrated model, both simulated with the calibrated model.

python -m tests.bench.purpose [CAMPAIGN] [--output DIR]: the campaign is looped where its adjusted design is not
there yet; the study of the bundled campaign is searched once with the declared and once with the adjusted vehicle.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from railui.execution.session import Session
from railui.execution.threads import ThreadRunner
from railui.optimisation.cases import cases_of
from railui.optimisation.evaluation import evaluate_in_process
from railui.optimisation.optimise import fresh_objectives, optimise, ride_quality
from railui.optimisation.search import baseline_values
from railui.optimisation.study import Study
from railui.optimisation.study_reader import load_study
from railui.vehicle.design import Design
from railui.vehicle.design_reader import load_design

HOME = Path(__file__).parents[2]
CAMPAIGN = HOME / "designs/campaigns/worn_axle_box"
SHOWN = ("score", "class", "comfort_hours", "weighted_acceleration", "flange_margin", "flange_fraction_gaussian")


def study_of(output: Path) -> Study:
    """The bundled study, on the adjusted vehicle of a loop in output/loop."""
    text = (HOME / "designs/studies/worn_axle_box.yaml").read_text("utf-8")
    line = next(line for line in text.splitlines() if line.startswith("vehicle:"))
    path = output / "study.yaml"
    path.write_text(text.replace(line, "vehicle: loop/adjusted.yaml"), "utf-8")
    return load_study(path)


def searched(study: Study, design: Design, out: Path) -> dict[str, Any]:
    """The study searched with a vehicle, its evaluations kept."""
    own = replace(study, design=design, name=f"{study.name}, {out.name}")
    with Session(own, out, ThreadRunner()) as session:
        return optimise(own, evaluator=session.evaluator, progress=session.progress())


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("campaign", nargs="?", type=Path, default=CAMPAIGN)
    parser.add_argument("--output", type=Path, default=HOME / "railui-study/purpose")
    args = parser.parse_args()
    looped = args.output / "loop"
    if not (looped / "adjusted.yaml").exists():
        words = [sys.executable, "-m", "railui", "loop", str(args.campaign), "-o", str(looped), "-q"]
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    files = {"declared": args.campaign / "vehicle.yaml", "adjusted": looped / "adjusted.yaml"}
    vehicles = {name: load_design(file) for name, file in files.items()}
    study = study_of(args.output)
    result = {name: searched(study, design, args.output / name) for name, design in vehicles.items()}
    knees = {name: one["pareto"][one["knee"]] for name, one in result.items() if one["knee"] is not None}
    x = np.array([baseline_values(study), *(list(knee["variables"].values()) for knee in knees.values())])
    ridden = ride_quality(cases_of(study), x)
    fresh = fresh_objectives(study, x, evaluate_in_process())
    names = ["vehicle as identified", *(f"optimum of the {name} model" for name in knees)]
    print(f"Ridden with the adjusted vehicle, means over {len(cases_of(study))} cases; aims on 8 sets of fresh seeds\n")
    for name, values, one, aims in zip(names, x, ridden, fresh.transpose(1, 0, 2), strict=True):
        print(name)
        for variable, value in zip(study.variables, values, strict=True):
            print(f"    {variable.path:44s} {value:12.5g} {variable.unit}")
        for key in SHOWN if one is not None else ():
            print(f"  {key:26s} {one[key] if isinstance(one[key], str) else format(one[key], '.4g')}")
        for aim, mean, sd in zip(study.objectives, aims.mean(axis=0), aims.std(axis=0, ddof=1), strict=True):
            print(f"  {aim.key}, {aim.over}, fresh: {mean:.4g} +/- {sd:.2g}")
    if "declared" in knees:
        predicted = result["declared"]["pareto"][result["declared"]["knee"]]["objectives"]
        print(f"\nThe declared model promised of its optimum: {', '.join(f'{value:.4g}' for value in predicted)}")
    different = fresh[:, -1] - fresh[:, -2]
    for j, aim in enumerate(study.objectives):
        mean, sd = different[:, j].mean(), different[:, j].std(ddof=1) / np.sqrt(len(different))
        print(f"adjusted less declared optimum, {aim.key}: {mean:+.4g} +/- {sd:.2g} (mean over 8 sets, its error)")


if __name__ == "__main__":
    main()
