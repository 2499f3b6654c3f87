"""Kernel against DOP853 to eleven digits, and the order of convergence of its steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
import pytest

from tests.kernel.pairs import Floats, asymmetric_bogie, kernel, required_steps, tangent_run
from tests.truth.effects import Effect, parse
from tests.truth.reference import reference

# 40 m/s and a sample every 0.1 m; the reference costs 10 ms a sample
RUN, VEHICLE = tangent_run(0.45, rate=400.0), asymmetric_bogie(50)
SLIP = [parse("creep_saturation at=contact friction=0.2")]
CLEARANCE = 1.5e-3  # m: narrow, so that the flanges touch many times in 18 m
FLANGE = [*SLIP, parse(f"flange_contact at=contact clearance={CLEARANCE} stiffness=14.6e6")]


@cache
def exact(flange: bool) -> dict[str, Floats]:
    return reference(VEHICLE, RUN, FLANGE if flange else SLIP)


def error(found: Mapping[str, Floats], truth: Mapping[str, Floats], channel: str = "e1") -> float:
    """Root mean square of the error of a channel, in units of its standard deviation."""
    return float(np.sqrt(np.mean((found[channel] - truth[channel]) ** 2)) / truth[channel].std())


def order(effects: Sequence[Effect], truth: Mapping[str, Floats], counts: Sequence[int]) -> float:
    """Slope of the error over the length of a step, both logarithmic."""
    errors = [error(kernel(VEHICLE, RUN, effects, n), truth) for n in counts]
    return -float(np.polyfit(np.log2(counts), np.log2(errors), 1)[0])


def test_the_flanges_touch_and_the_creep_forces_saturate() -> None:
    touching = np.abs(exact(True)["e1"]) > CLEARANCE
    assert np.count_nonzero(np.diff(touching.astype(int)) == 1) >= 3
    assert np.abs(kernel(VEHICLE, RUN)["e1"] - exact(False)["e1"]).max() > 0.03 * exact(False)["e1"].std()


@pytest.mark.parametrize("channel", ["e1", "e2", "psi1"])
@pytest.mark.parametrize(("flange", "within"), [(False, 1e-5), (True, 1e-4)], ids=["free", "flange"])
def test_one_step_per_sample_is_accurate_enough(channel: str, flange: bool, within: float) -> None:
    effects = FLANGE if flange else SLIP
    assert required_steps(VEHICLE, RUN, effects) == 1
    assert error(kernel(VEHICLE, RUN, effects, 1), exact(flange), channel) < within


def test_many_steps_are_the_reference() -> None:
    assert error(kernel(VEHICLE, RUN, SLIP, 16), exact(False)) < 1e-9
    assert error(kernel(VEHICLE, RUN, FLANGE, 64), exact(True)) < 1e-7


def test_steps_converge_with_the_fourth_order_where_the_vehicle_is_smooth() -> None:
    assert order(SLIP, exact(False), [1, 2, 4, 8]) == pytest.approx(4.0, abs=0.2)


def test_steps_converge_with_the_second_order_where_the_flanges_touch() -> None:
    assert order(FLANGE, exact(True), [1, 2, 4, 8, 16, 32]) > 1.8
