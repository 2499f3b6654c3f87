"""A vehicle that is not the same from run to run: what differs, where it acts, and that no fit has seen it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.estimation.output_error import Fit
from railui.identification.estimation.validation import estimate_noise_floor, validate
from railui.identification.loop import LoopResult, calibrate, close_loop
from railui.identification.structure.stepwise import ADEQUATE
from railui.identification.unmodelled.run_dependence import RunDependence, prepare_validation, test_run_dependence
from railui.report.loop.data import loop_report
from railui.report.loop.page import page
from railui.vehicle.model import Model
from tests.docs.results import rows_of, undocumented
from tests.truth.campaign import Campaign, Order, campaign, campaigns, drawn, write
from tests.truth.effects import effect

DAMPING = "vehicle.secondary.lateral_damping"
STIFFNESS = "vehicle.secondary.lateral_stiffness"
SEED = 3


@dataclass(frozen=True, eq=False)
class Case:
    """A campaign whose vehicle has other numbers on some runs, the declared vehicle, and that adjusted."""

    measurement: Dataset
    declared: Model
    fit: Fit

    def change(self) -> RunDependence | None:
        """What differs from run to run."""
        here = prepare_validation(self.fit, self.measurement)
        assert here is not None
        return test_run_dependence(self.fit, here, self.measurement, self.declared)


@dataclass(frozen=True)
class Drawn:
    """What is driven: letters of the vehicle on each run as factors of its own, the speeds, what else is ordered."""

    runs: Sequence[Mapping[str, float]]
    speeds: Sequence[float] = (40.0, 31.0)
    more: Mapping[str, float] = field(default_factory=dict)

    def orders(self) -> list[Order]:
        """One campaign for each vehicle, of which one run is taken."""
        order = Order(seed=SEED, speeds=self.speeds, seconds=(25.0, 20.0, 20.0)[: len(self.runs)], **self.more)  # type: ignore[arg-type]
        vehicle = drawn(order)
        there = [replace(vehicle, **{k: times(getattr(vehicle, k), f) for k, f in run.items()}) for run in self.runs]
        return [replace(order, vehicle=v) for v in there]


DRAWN = {
    "a stronger damper": Drawn([{}, {"k_y": 1.3}]),
    "a stiffer spring": Drawn([{}, {"c_sy": 1.5}]),
    "worn rails": Drawn([{}, {"lam": 1.15}]),
    "a stronger and a weaker damper": Drawn([{}, {"k_y": 1.3}, {"k_y": 0.75}], (40.0, 31.0, 35.0)),
    "nothing": Drawn([{}, {}]),
    "coloured noise": Drawn([{}, {}], more={"coloured": 0.02}),
    "an unmeasured force": Drawn([{}, {}], more={"unmeasured": 100.0}),
}


@cache
def driven(unmeasured: bool) -> dict[str, Campaign]:
    """All campaigns with or without an unmeasured force, driven side by side."""
    orders = {name: one.orders() for name, one in DRAWN.items() if ("unmeasured" in one.more) == unmeasured}
    parts = iter(campaigns([order for some in orders.values() for order in some]))
    found = {}
    for name, some in orders.items():
        own = [next(parts) for _ in some]
        runs = {letter: part.runs[letter] for part, letter in zip(own, "abc", strict=False)}
        found[name] = replace(own[0], runs=runs)
    return found


@cache
def case(name: str) -> Case:
    """One of these campaigns, adjusted to its first run; all others validate."""
    with tempfile.TemporaryDirectory() as folder:
        write(driven("unmeasured" in DRAWN[name].more)[name], Path(folder))
        measurement = read_dataset(load_campaign(folder))
    judging = tuple(replace(s, role="validate") if s.run_index else s for s in measurement.segments)
    measurement = replace(measurement, segments=judging)
    declared = Model(measurement.campaign.design)
    return Case(measurement, declared, calibrate(measurement, declared, jobs=2))


def times(value: Any, factor: float) -> Any:
    return tuple(x * factor for x in value) if isinstance(value, tuple) else value * factor


def true(letter: str) -> float:
    return float(getattr(drawn(Order(seed=SEED)), letter))


def test_a_damper_that_is_stronger_on_the_validating_run_is_found_with_its_value_on_both():
    change = case("a stronger damper").change()
    assert change is not None and change.path == DAMPING and change.p < 0.01
    a, b = change.runs
    assert (a.role, b.role) == ("adjust", "validate")
    assert a.value == pytest.approx(true("k_y"), abs=4.0 * a.sd)
    assert b.value == pytest.approx(1.3 * true("k_y"), abs=4.0 * b.sd)
    assert b.sd < 0.05 * b.value


def test_with_its_own_value_the_validating_run_is_at_its_floor():
    stronger = case("a stronger damper")
    m, change = stronger.measurement, stronger.change()
    least = estimate_noise_floor(stronger.fit.model, m, m.validation, 5).nrmse
    assert change is not None and change.judged.nrmse < ADEQUATE * least
    assert validate(stronger.fit.model, m, m.validation).nrmse > 1.1 * change.judged.nrmse


def test_a_spring_that_is_not_adjusted_may_differ_as_well():
    change = case("a stiffer spring").change()
    assert change is not None and change.path == STIFFNESS
    assert change.runs[1].value == pytest.approx(1.5 * true("c_sy"), rel=0.05)
    assert change.runs[0].sd == 0.0  # held as declared


def test_the_conicity_of_both_wheelsets_differs_in_proportion():
    change = case("worn rails").change()
    assert change is not None and set(change.ratios) == {f"contact.{w}.conicity" for w in ("leading", "trailing")}
    assert change.runs[1].value / change.runs[0].value == pytest.approx(1.15, rel=0.02)


def test_each_of_two_validating_runs_has_a_value_of_its_own_to_either_side():
    change = case("a stronger and a weaker damper").change()
    assert change is not None and change.path == DAMPING
    assert [r.value / true("k_y") for r in change.runs[1:]] == pytest.approx([1.3, 0.75], rel=0.08)


@pytest.mark.parametrize(
    "name", ["nothing", "coloured noise", pytest.param("an unmeasured force", marks=pytest.mark.slow)]
)
def test_of_one_vehicle_nothing_differs_however_its_noise_is_coloured_or_what_pushes_it(name: str):
    one = case(name)
    if (change := one.change()) is not None:  # what is more than chance is far from what counts
        alone = validate(one.fit.model, one.measurement, one.measurement.validation)
        assert alone.error_reduction(change.judged)[0] < 0.05


@pytest.fixture(scope="module")
def closed() -> tuple[LoopResult, dict[str, Any]]:
    one = close_loop(case("a stronger damper").measurement, jobs=2)
    return one, loop_report(one)


def test_the_verdict_is_outside_at_the_place_of_what_differs_and_the_sentence_tells_both_values(
    closed: tuple[LoopResult, dict[str, Any]],
):
    one, report = closed
    assert (report["verdict"], report["outside"]["at"], report["effects"]) == ("outside", "secondary_lateral", [])
    assert f"the vehicle is not the same from run to run, {DAMPING} would be" in report["sentence"]
    a, b = report["outside"]["runs"]
    assert f"kN*s/m on {a['file']} (" in report["sentence"] and f"kN*s/m on {b['file']} (" in report["sentence"]
    assert "not the same from run to run: secondary lateral" in page(one, report)


def test_the_error_stays_that_of_the_vehicle_that_saw_only_its_own_runs(closed: tuple[LoopResult, dict[str, Any]]):
    _, report = closed
    assert report["after"]["nrmse"] == report["before"]["nrmse"] > report["outside"]["nrmse"]
    assert report["unexplained"] > 1.1
    assert report["parameters"][DAMPING]["value"] == report["outside"]["runs"][0]["value"]


def test_what_differs_is_written_as_a_parameter_over_the_distance_of_the_run_that_asks_for_it(
    closed: tuple[LoopResult, dict[str, Any]],
):
    one, report = closed
    outside = report["outside"]
    (stretch,) = one.dataset.validation
    assert outside["against"] == "s" and outside["motion"] == stretch.columns["s"][[0, -1]].tolist()
    assert outside["force"] == 2 * [outside["runs"][1]["value"]] and outside["force_unit"] == "N*s/m"
    assert undocumented([report], rows_of("loop")) == []


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "at", "damping"), [(6018, "secondary_lateral", 1.2e5), (7007, "secondary_yaw", 3e5)])
def test_a_damper_that_fades_as_it_heats_is_told_as_outside_at_its_place(
    seed: int, at: str, damping: float, tmp_path: Path
):
    fading = effect("fading_damper", at, damping=damping, energy=60.0)
    write(campaign(Order(effects=(fading,), seed=seed)), tmp_path)
    report = loop_report(close_loop(read_dataset(load_campaign(tmp_path)), jobs=2))
    assert (report["verdict"], report["outside"]["at"], report["effects"]) == ("outside", at, [])
    hot, cool = report["outside"]["runs"]
    assert hot["speed"] > cool["speed"] and hot["value"] < cool["value"]
    assert report["outside"]["nrmse"] < ADEQUATE * report["floor"]["nrmse"] < report["after"]["nrmse"]
