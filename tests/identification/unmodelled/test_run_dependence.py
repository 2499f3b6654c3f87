"""Run-to-run variation: the parameter that differs, its location, and the independence of the validation runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.settings.detection import SelectionSettings
from railui.identification.context import WithContext, create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.noise_floor import estimate_noise_floor
from railui.identification.estimation.validation import validate
from railui.identification.loop import close_loop
from railui.identification.result import LoopResult
from railui.identification.unmodelled import run_dependence
from railui.identification.unmodelled.run_dependence import RunDependence, detect_run_dependence, prepare_validation
from railui.report.loop.data import loop_report
from railui.report.loop.page import render_page
from tests.blind.simulated import recorded
from tests.docs.results import rows_of, undocumented_keys
from tests.truth.campaign import Campaign, Order, campaign, campaigns, drawn, write
from tests.truth.effects import Effect, effect

DAMPING = "vehicle.secondary.lateral_damping"
STIFFNESS = "vehicle.secondary.lateral_stiffness"
SEED = 3
ADEQUATE = SelectionSettings().adequate_ratio


@dataclass(frozen=True, eq=False)
class Case(WithContext):
    """A campaign whose vehicle has other parameters on some runs, with its context and the calibrated model."""

    fit: Fit

    def run_dependence(self) -> RunDependence | None:
        """Detect the parameter that differs from run to run."""
        validation_fit = prepare_validation(self.context, self.fit)
        assert validation_fit is not None
        return detect_run_dependence(self.context, self.fit, validation_fit)


@dataclass(frozen=True)
class Scenario:
    """Vehicles of a simulated campaign: factors on their parameters on each run, speeds, and further options."""

    runs: Sequence[Mapping[str, float]]
    speeds: Sequence[float] = (40.0, 31.0)
    options: Mapping[str, float] = field(default_factory=dict)
    last_effects: tuple[Effect, ...] = ()  # of the last run

    def orders(self) -> list[Order]:
        """Order one campaign for each vehicle, of which one run is used."""
        order = Order(seed=SEED, speeds=self.speeds, seconds=(25.0, 20.0, 20.0)[: len(self.runs)], **self.options)  # type: ignore[arg-type]
        vehicle = drawn(order)
        vehicles = [replace(vehicle, **{k: scale(getattr(vehicle, k), f) for k, f in run.items()}) for run in self.runs]
        orders = [replace(order, vehicle=v) for v in vehicles]
        return [*orders[:-1], replace(orders[-1], effects=self.last_effects)]


SCENARIOS = {
    "a stronger damper": Scenario([{}, {"k_y": 1.3}]),
    "a stiffer spring": Scenario([{}, {"c_sy": 1.5}]),
    "worn rails": Scenario([{}, {"lam": 1.15}]),
    "much worn rails": Scenario([{}, {"lam": 1.5}]),
    "a broken spring": Scenario([{}, {}], last_effects=(effect("spring", "primary_lateral", 1, stiffness=-3e6),)),
    "a stronger and a weaker damper": Scenario([{}, {"k_y": 1.3}, {"k_y": 0.75}], (40.0, 31.0, 35.0)),
    "nothing": Scenario([{}, {}]),
    "coloured noise": Scenario([{}, {}], options={"coloured": 0.02}),
    "an unmeasured force": Scenario([{}, {}], options={"unmeasured": 100.0}),
}


@cache
def simulated(unmeasured: bool) -> dict[str, Campaign]:
    """Simulate all campaigns with or without an unmeasured force in one batch."""
    orders = {
        name: scenario.orders()
        for name, scenario in SCENARIOS.items()
        if ("unmeasured" in scenario.options) == unmeasured
    }
    parts = iter(campaigns([order for some in orders.values() for order in some]))
    cases = {}
    for name, some in orders.items():
        selected = [next(parts) for _ in some]
        runs = {letter: part.runs[letter] for part, letter in zip(selected, "abc", strict=False)}
        cases[name] = replace(selected[0], runs=runs)
    return cases


@cache
def case(name: str) -> Case:
    """Calibrate on the first run of one of these campaigns; all others are validation runs."""
    dataset = recorded(simulated("unmeasured" in SCENARIOS[name].options)[name])
    segments = tuple(replace(s, role="validate") if s.run_index else s for s in dataset.segments)
    dataset = replace(dataset, segments=segments)
    context = create_context(dataset, jobs=2)
    return Case(context, calibrate(context))


def scale(value: Any, factor: float) -> Any:
    return tuple(x * factor for x in value) if isinstance(value, tuple) else value * factor


def true_value(letter: str) -> float:
    return float(getattr(drawn(Order(seed=SEED)), letter))


def test_a_stronger_damper_on_the_validation_run_is_estimated_on_both_runs():
    variation = case("a stronger damper").run_dependence()
    assert variation is not None and variation.path == DAMPING and variation.p < 0.01
    a, b = variation.runs
    assert (a.role, b.role) == ("adjust", "validate")
    assert a.value == pytest.approx(true_value("k_y"), abs=4.0 * a.sd)
    assert b.value == pytest.approx(1.3 * true_value("k_y"), abs=4.0 * b.sd)
    assert b.sd < 0.05 * b.value


def test_with_a_separate_value_the_validation_run_reaches_its_noise_floor():
    stronger = case("a stronger damper")
    m, variation = stronger.dataset, stronger.run_dependence()
    least = estimate_noise_floor(stronger.context, stronger.fit.model, m.validation, 5).nrmse
    assert variation is not None and variation.validation.nrmse < ADEQUATE * least
    assert validate(stronger.context, stronger.fit.model, m.validation).nrmse > 1.1 * variation.validation.nrmse


def test_a_spring_that_is_not_estimated_may_differ_as_well():
    variation = case("a stiffer spring").run_dependence()
    assert variation is not None and variation.path == STIFFNESS
    assert variation.runs[1].value == pytest.approx(1.5 * true_value("c_sy"), rel=0.05)
    assert variation.runs[0].sd == 0.0  # fixed at its nominal value


def test_the_conicity_of_both_wheelsets_differs_in_proportion():
    variation = case("worn rails").run_dependence()
    assert variation is not None and set(variation.ratios) == {f"contact.{w}.conicity" for w in ("leading", "trailing")}
    assert variation.runs[1].value / variation.runs[0].value == pytest.approx(1.15, rel=0.02)


def test_a_large_difference_is_that_of_the_parameter_whose_values_leave_the_least_misfit():
    """The residual is far from linear in it: the linear shares of other parameters are larger."""
    variation = case("much worn rails").run_dependence()
    assert variation is not None and set(variation.ratios) == {f"contact.{w}.conicity" for w in ("leading", "trailing")}
    assert variation.runs[1].value / variation.runs[0].value == pytest.approx(1.5, rel=0.02)


def test_a_difference_that_no_parameter_explains_is_located_on_the_validation_runs():
    """A spring of one wheelset is broken there: the stiffness of both explains a part."""
    result = close_loop(case("a broken spring").dataset, jobs=2)
    found = result.discrepancy
    assert result.verdict == "outside" and found is not None and found.run_dependence is None
    assert found.is_unexplained_difference and (found.at, found.wheelset) == ("primary_lateral", 1)
    assert 0.9 < found.evidence.share <= 1.0 and found.is_located(result.context.settings.verdict)
    report = loop_report(result)
    assert "no single parameter explains the difference" in report["sentence"]
    assert report["outside"]["differs"] and report["outside"]["force"] == []
    assert undocumented_keys([report], rows_of("loop")) == []
    assert "difference between runs: lateral primary suspension" in render_page(result, report)


def test_two_validation_runs_have_separate_values():
    variation = case("a stronger and a weaker damper").run_dependence()
    assert variation is not None and variation.path == DAMPING
    assert [r.value / true_value("k_y") for r in variation.runs[1:]] == pytest.approx([1.3, 0.75], rel=0.08)


def test_a_parameter_without_influence_on_a_run_keeps_its_value_there():
    """On the last run the forces of the carbody are measured, in place of the secondary suspension."""
    selected = case("a stronger and a weaker damper")
    *others, last = selected.dataset.segments
    forces = {name: np.zeros(last.samples) for name in ("Qy", "Qpsi")}
    measured = replace(last, columns={**last.columns, **forces}, tables={})
    context = replace(selected.context, dataset=replace(selected.dataset, segments=(*others, measured)))
    validation_fit = prepare_validation(context, selected.fit)
    assert validation_fit is not None
    scores = run_dependence._RunScores(context, selected.fit, validation_fit)
    misfit, estimates = scores._estimate_values(((DAMPING, 1.0),))
    value, sd = estimates[last.run_index]
    assert np.isfinite(misfit) and value == selected.fit.model.value(DAMPING) and np.isinf(sd)
    assert estimates[others[-1].run_index][0] == pytest.approx(1.3 * true_value("k_y"), rel=0.08)


@pytest.mark.parametrize(
    "name", ["nothing", "coloured noise", pytest.param("an unmeasured force", marks=pytest.mark.slow)]
)
def test_noise_and_unmeasured_forces_are_no_run_to_run_variation(name: str):
    selected = case(name)
    if (variation := selected.run_dependence()) is not None:  # significant, but far from relevant
        alone = validate(selected.context, selected.fit.model, selected.dataset.validation)
        assert alone.error_reduction(variation.validation)[0] < 0.05


@pytest.fixture(scope="module")
def closed() -> tuple[LoopResult, dict[str, Any]]:
    result = close_loop(case("a stronger damper").dataset, jobs=2)
    return result, loop_report(result)


def test_the_verdict_names_the_location_and_the_sentence_both_values(
    closed: tuple[LoopResult, dict[str, Any]],
):
    result, report = closed
    assert (report["verdict"], report["outside"]["at"], report["effects"]) == ("outside", "secondary_lateral", [])
    assert f"the vehicle is not the same from run to run, {DAMPING} would be" in report["sentence"]
    a, b = report["outside"]["runs"]
    assert f"kN*s/m on {a['file']} (" in report["sentence"] and f"kN*s/m on {b['file']} (" in report["sentence"]
    assert "parameter that differs from run to run: lateral secondary suspension" in render_page(result, report)


def test_the_reported_error_is_that_of_the_calibrated_model(closed: tuple[LoopResult, dict[str, Any]]):
    _, report = closed
    assert report["after"]["nrmse"] == report["before"]["nrmse"] > report["outside"]["nrmse"]
    assert report["unexplained"] > 1.1
    assert report["parameters"][DAMPING]["value"] == report["outside"]["runs"][0]["value"]


def test_the_difference_is_reported_as_a_parameter_over_distance(
    closed: tuple[LoopResult, dict[str, Any]],
):
    result, report = closed
    outside = report["outside"]
    (segment,) = result.dataset.validation
    assert outside["against"] == "s" and outside["motion"] == segment.columns["s"][[0, -1]].tolist()
    assert outside["force"] == 2 * [outside["runs"][1]["value"]] and outside["force_unit"] == "N*s/m"
    assert undocumented_keys([report], rows_of("loop")) == []


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "at", "damping"), [(6018, "secondary_lateral", 1.2e5), (7007, "secondary_yaw", 3e5)])
def test_a_fading_damper_is_reported_as_outside_at_its_location(seed: int, at: str, damping: float, tmp_path: Path):
    fading = effect("fading_damper", at, damping=damping, energy=60.0)
    write(campaign(Order(effects=(fading,), seed=seed)), tmp_path)
    report = loop_report(close_loop(read_dataset(load_campaign(tmp_path)), jobs=2))
    assert (report["verdict"], report["outside"]["at"], report["effects"]) == ("outside", at, [])
    hot, cool = report["outside"]["runs"]
    assert hot["speed"] > cool["speed"] and hot["value"] < cool["value"]
    assert report["outside"]["nrmse"] < ADEQUATE * report["floor"]["nrmse"] < report["after"]["nrmse"]
