"""A vehicle that is not the same from run to run: what differs, where it acts, and that no fit has seen it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from railui.files.campaign import load_campaign
from railui.report.loop import loop_report
from railui.report.page import page
from railui.study.adjust import Fit
from railui.study.between import Change, differing, laid
from railui.study.judge import floor, judge
from railui.study.loop import Found, adjusted, close_loop
from railui.study.measured import Measurement, read
from railui.study.model import Model
from tests.docs.results import rows_of, undocumented
from tests.truth.campaign import Order, campaigns, drawn, write

DAMPING = "vehicle.secondary.lateral_damping"
STIFFNESS = "vehicle.secondary.lateral_stiffness"
SEED = 3
STRONGER = ({}, {"k_y": 1.3})  # letters of the vehicle on each run, as factors of its own


@dataclass(frozen=True, eq=False)
class Case:
    """A campaign whose vehicle has other numbers on some runs, the declared vehicle, and that adjusted."""

    measurement: Measurement
    declared: Model
    fit: Fit

    def change(self) -> Change | None:
        """What differs from run to run."""
        here = laid(self.fit, self.measurement)
        assert here is not None
        return differing(self.fit, here, self.measurement, self.declared)


def measured(runs: Sequence[Mapping[str, float]], roles: Sequence[str] = (), **more: Any) -> Case:
    """Each run of a vehicle that has so many times its letters there; roles: other than the last validating."""
    order = Order(**{"seed": SEED, "speeds": (40.0, 31.0), "seconds": (25.0, 20.0)} | more)
    vehicle = drawn(order)
    there = [replace(vehicle, **{k: times(getattr(vehicle, k), f) for k, f in run.items()}) for run in runs]
    parts = campaigns([replace(order, vehicle=v) for v in there])
    own = {name: part.runs[name] for part, name in zip(parts, parts[0].runs, strict=True)}
    with tempfile.TemporaryDirectory() as folder:
        write(replace(parts[0], runs=own), Path(folder))
        measurement = read(load_campaign(folder))
    stretches = tuple(replace(s, role=roles[s.run] if roles else s.role) for s in measurement.stretches)
    measurement = replace(measurement, stretches=stretches)
    declared = Model(measurement.campaign.design)
    return Case(measurement, declared, adjusted(measurement, declared, jobs=2))


def times(value: Any, factor: float) -> Any:
    return tuple(x * factor for x in value) if isinstance(value, tuple) else value * factor


def true(letter: str) -> float:
    return float(getattr(drawn(Order(seed=SEED)), letter))


@pytest.fixture(scope="module")
def stronger() -> Case:
    """A damper that is stronger on the validating run."""
    return measured(STRONGER)


def test_a_damper_that_is_stronger_on_the_validating_run_is_found_with_its_value_on_both(stronger: Case):
    change = stronger.change()
    assert change is not None and change.path == DAMPING and change.p < 0.01
    a, b = change.runs
    assert (a.role, b.role) == ("adjust", "validate")
    assert a.value == pytest.approx(true("k_y"), abs=4.0 * a.sd)
    assert b.value == pytest.approx(1.3 * true("k_y"), abs=4.0 * b.sd)
    assert b.sd < 0.05 * b.value


def test_with_its_own_value_the_validating_run_is_at_its_floor(stronger: Case):
    m, change = stronger.measurement, stronger.change()
    least = floor(stronger.fit.model, m, m.validate, 5).nrmse
    assert change is not None and change.judged.nrmse < 1.05 * least
    assert judge(stronger.fit.model, m, m.validate).nrmse > 1.1 * least


def test_a_spring_that_is_not_adjusted_may_differ_as_well():
    change = measured([{}, {"c_sy": 1.5}]).change()
    assert change is not None and change.path == STIFFNESS
    assert change.runs[1].value == pytest.approx(1.5 * true("c_sy"), rel=0.05)
    assert change.runs[0].sd == 0.0  # held as declared


def test_the_conicity_of_both_wheelsets_differs_in_proportion():
    change = measured([{}, {"lam": 1.15}]).change()
    assert change is not None and set(change.ratios) == {f"contact.{w}.conicity" for w in ("leading", "trailing")}
    assert change.runs[1].value / change.runs[0].value == pytest.approx(1.15, rel=0.02)


def test_each_of_two_validating_runs_has_a_value_of_its_own_to_either_side():
    runs = [{}, {"k_y": 1.3}, {"k_y": 0.75}]
    more = {"speeds": (40.0, 31.0, 35.0), "seconds": (25.0, 20.0, 20.0)}
    change = measured(runs, ("adjust", "validate", "validate"), **more).change()
    assert change is not None and change.path == DAMPING
    assert [r.value / true("k_y") for r in change.runs[1:]] == pytest.approx([1.3, 0.75], rel=0.08)


@pytest.mark.parametrize("nuisance", [{}, {"coloured": 0.02}, {"unmeasured": 100.0}])
def test_of_one_vehicle_nothing_differs_however_its_noise_is_coloured_or_what_pushes_it(nuisance: dict[str, float]):
    case = measured([{}, {}], **nuisance)
    if (change := case.change()) is not None:  # what is more than chance is far from what counts
        alone = judge(case.fit.model, case.measurement, case.measurement.validate)
        assert alone.gain_of(change.judged)[0] < 0.05


@pytest.fixture(scope="module")
def closed(stronger: Case) -> tuple[Found, dict[str, Any]]:
    one = close_loop(stronger.measurement, jobs=2)
    return one, loop_report(one)


def test_the_verdict_is_outside_at_the_place_of_what_differs_and_the_sentence_tells_both_values(
    closed: tuple[Found, dict[str, Any]],
):
    one, report = closed
    assert (report["verdict"], report["outside"]["at"], report["effects"]) == ("outside", "secondary_lateral", [])
    assert f"the vehicle is not the same from run to run, {DAMPING} would be" in report["sentence"]
    a, b = report["outside"]["runs"]
    assert f"kN*s/m on {a['file']} (" in report["sentence"] and f"kN*s/m on {b['file']} (" in report["sentence"]
    assert "not the same from run to run: secondary lateral" in page(one, report)


def test_the_error_stays_that_of_the_vehicle_that_saw_only_its_own_runs(closed: tuple[Found, dict[str, Any]]):
    _, report = closed
    assert report["after"]["nrmse"] == report["before"]["nrmse"] > report["outside"]["nrmse"]
    assert report["unexplained"] > 1.1
    assert report["parameters"][DAMPING]["value"] == report["outside"]["runs"][0]["value"]


def test_what_differs_is_written_as_a_parameter_over_the_distance_of_the_run_that_asks_for_it(
    closed: tuple[Found, dict[str, Any]],
):
    one, report = closed
    outside = report["outside"]
    (stretch,) = one.measurement.validate
    assert outside["against"] == "s" and outside["motion"] == stretch.columns["s"][[0, -1]].tolist()
    assert outside["force"] == 2 * [outside["runs"][1]["value"]] and outside["force_unit"] == "N*s/m"
    assert undocumented([report], rows_of("loop")) == []
