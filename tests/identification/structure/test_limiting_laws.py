"""Limits of laws: friction that never yields gives way to the spring that it is, and one that yields stays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.context import Context, create_context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import prepare_segments
from railui.identification.prediction import Predictor
from railui.identification.structure.candidate_scores import NO_SCORE_TEST
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.limiting_laws import limiting_effects, replace_by_limits
from railui.identification.structure.refit import Refit
from railui.identification.structure.stage import SelectionStep, Stage, validated_stage
from railui.vehicle.design_reader import load_design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model
from tests.truth.files import write_run
from tests.truth.tracks import met

DESIGN = Path(__file__).parents[3] / "designs" / "bogie_under_coach.yaml"
DAMPING = "vehicle.elements.secondary_damper.lateral_damping"
UNITS = {"t": "s", "s": "m", "v": "m/s", "yw": "m", "phiw": "rad", "ay.body": "m/s^2", "ayf": "m/s^2", "d1": "m"}
NOISE = {"ay.body": 0.02, "ayf": 0.05, "d1": 2e-5, "yw": 1e-6, "phiw": 1e-6}
AT = "secondary_lateral"
SPRING = PlacedEffect("spring", AT, None, {"stiffness": 2e5})
STUCK = PlacedEffect("hysteresis", AT, None, {"stiffness": 2e5, "yield": 2e4})
YIELDING = PlacedEffect("hysteresis", AT, None, {"stiffness": 8e5, "yield": 1e3})


def simulated(folder: Path, *true: PlacedEffect) -> Context:
    """Context of runs simulated by the vehicle with effects, with noise."""
    rng = np.random.default_rng(5)
    names = ["ay.body", "ayf", "d1"]
    (folder / "vehicle.yaml").write_text(DESIGN.read_text("utf-8"), "utf-8")
    runs = [{"file": f"run_{x}.csv.gz", "role": role} for x, role in (("a", "adjust"), ("b", "validate"))]
    text = {"vehicle": "vehicle.yaml", "runs": runs, "adjust": [DAMPING], "noise": NOISE}
    (folder / "campaign.yaml").write_text(yaml.safe_dump(text, sort_keys=False), "utf-8")
    for k, x in enumerate("ab"):
        run = met((36.0, 32.0)[k], 14.0, 70 + k, "low", rate=200.0, before=0.0, spread=0.5)
        columns = {"t": run.t, "s": run.s, "v": run.v, "yw": run.yw, "phiw": run.phiw}
        write_run(
            folder / f"run_{x}.csv.gz", columns | {c: 1e-3 * rng.standard_normal(len(run.t)) for c in names}, UNITS
        )
    context = create_context(read_dataset(load_campaign(folder)), jobs=1)
    for x, segment in zip("ab", context.dataset.segments, strict=True):
        series = Predictor(with_effects(context.nominal, true), segment).simulate(names).series[0]
        noisy = {c: s + NOISE[c] * rng.standard_normal(len(s)) for c, s in zip(names, series, strict=True)}
        write_run(folder / f"run_{x}.csv.gz", {c: segment.columns[c] for c in list(UNITS)[:5]} | noisy, UNITS)
    return create_context(read_dataset(load_campaign(folder)), jobs=1)


def with_effects(model: Model, effects: Sequence[PlacedEffect]) -> Model:
    for effect in effects:
        model = model.with_effect(effect)
    return model


def refit(context: Context, effect: PlacedEffect) -> Fit:
    model = context.nominal.with_effect(effect)
    segments = prepare_segments(context, model, context.dataset.estimation)
    return fit_output_error(context, model, [DAMPING, *model.effect_paths()], segments=segments, tolerance=1e-5)


def after_limits(context: Context, effect: PlacedEffect) -> tuple[Stage, Stage, SelectionStep]:
    """Stage before and after, and the step of the selection."""
    fit = refit(context, effect)
    steps = [SelectionStep(NO_SCORE_TEST, (), Refit(Candidate(effect.kind, effect.at, None), fit, np.zeros((1, 3))))]
    before = validated_stage(context, fit)
    after = replace_by_limits(context, before, steps, lambda f: refit(context, f.model.effects[-1]))
    return before, after, steps[0]


def test_friction_that_never_yields_is_a_spring(tmp_path: Path) -> None:
    context = simulated(tmp_path, SPRING)
    _, after, step = after_limits(context, STUCK)
    effect = after.fit.model.effects[-1]
    assert (effect.kind, effect.at) == ("spring", AT)
    assert effect.parameters["stiffness"] == pytest.approx(2e5, rel=0.05)
    assert step.added is not None and step.added.candidate == Candidate("spring", AT, None)


def test_friction_that_yields_stays(tmp_path: Path) -> None:
    context = simulated(tmp_path, YIELDING)
    before, after, step = after_limits(context, YIELDING)
    assert after is before
    assert step.added is not None and step.added.candidate == Candidate("hysteresis", AT, None)


def test_the_limits_of_a_law_act_at_its_joint_and_are_no_estimated_parameters(tmp_path: Path) -> None:
    context = simulated(tmp_path, SPRING)
    coach = replace(context.nominal, design=load_design(DESIGN.parent / "manchester_coach.yaml"))
    damper = PlacedEffect("maxwell_damper", "lateral_damper_lateral", 2, {"stiffness": 6e6, "damping": 3e4})
    assert limiting_effects(context, coach, damper) == [
        PlacedEffect("viscous_damper", "lateral_damper_lateral", 2, {"damping": 3e4}),
        PlacedEffect("spring", "secondary_lateral", 2, {"stiffness": 6e6}),
    ]
    friction = PlacedEffect("dry_friction", "secondary_damper_lateral", None, {"force": 900.0, "slip_speed": 0.01})
    assert limiting_effects(context, context.nominal, friction) == []  # the damping there is estimated
    assert limiting_effects(context, context.nominal, replace(friction, at="primary_lateral")) == [
        PlacedEffect("viscous_damper", "primary_lateral", None, {"damping": 9e4})
    ]
