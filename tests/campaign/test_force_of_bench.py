"""Sign and delay of the force of a component on a bench, in all runs or in one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from railui.campaign.faults.fault import Fault
from railui.campaign.faults.force_of_bench import faults_of_force
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from railui.vehicle.design_reader import load_design
from tests.truth.laws import Array

Law = Callable[[Array, Array], Array]
DT, SAMPLES = 0.004, 5000
T = np.arange(SAMPLES) * DT
DESIGN = load_design(
    "name: bench\nvehicle: {rig: {input: motion, stiffness: 350 kN/m, damping: 1.2 kN*s/m, preload: 100 N}}"
)


def spring(z: Array, v: Array) -> Array:
    return 150.0 + 4.1e5 * z + 900.0 * v


def sine(frequency: float, amplitude: float) -> Array:
    return amplitude * np.sin(2.0 * np.pi * frequency * T)


def multisine(seed: int, amplitude: float, high: float = 10.0) -> Array:
    rng = np.random.default_rng(seed)
    phases, lines = rng.uniform(0.0, 2.0 * np.pi, 100), rng.uniform(0.2, high, 100)
    return amplitude * np.sin(2.0 * np.pi * lines * T[:, None] + phases).sum(axis=1) / np.sqrt(50.0)


MOTIONS = (multisine(1, 2e-3), sine(0.7, 4e-3), multisine(2, 1e-3))


def runs(law: Law, motions: Sequence[Array] = MOTIONS) -> dict[str, list[Segment]]:
    """Runs a, b, c, ... of a component with 1 % of noise in its force."""
    out = {}
    for i, z in enumerate(motions):
        force = law(z, np.gradient(z, DT))
        force = force + 0.01 * force.std() * np.random.default_rng(i).standard_normal(SAMPLES)
        name = "abc"[i]
        out[name] = [Segment(name, "adjust", 0, {"t": T, "z": z, "F": force}, DT, "bench", run_index=i)]
    return out


def changed(some: dict[str, list[Segment]], name: str, change: Callable[[Array], Array]) -> dict[str, list[Segment]]:
    segment = some[name][0]
    columns = {**segment.columns, "F": change(segment.columns["F"])}
    return some | {name: [replace(segment, columns=columns, tables={})]}


def late(force: Array) -> Array:
    return np.concatenate([np.full(18, force[0]), force[:-18]])


def faults(some: dict[str, list[Segment]]) -> list[Fault]:
    return faults_of_force(DESIGN, some, FaultSettings())


@pytest.mark.parametrize(
    "law",
    [
        spring,
        lambda z, v: 3.0e4 * v + 200.0 * np.tanh(v / 1e-3),
        lambda z, v: -2.0e5 * z + 6e11 * z**3 + 3e3 * v,  # a snap-through
        lambda z, v: -4.0e5 * z + 2e3 * v,  # a negative stiffness
        lambda z, v: 4.1e5 * z + 500.0 * np.tanh(v / 1e-3) * (1.0 + 200.0 * z),  # a wedge
    ],
)
def test_a_sound_component_has_no_fault(law: Law) -> None:
    assert faults(runs(law)) == []


def test_a_force_with_the_wrong_sign_in_all_runs_opposes_the_nominal_model() -> None:
    [fault] = faults(runs(lambda z, v: -spring(z, v)))
    assert fault.serious and fault.is_correctable and fault.yaml == "sensors: {F: {gain: -1}}"


@pytest.mark.parametrize("name", ["a", "b"])
def test_a_force_with_the_wrong_sign_in_one_run_is_named_with_it(name: str) -> None:
    [fault] = faults(changed(runs(spring), name, lambda x: -x))
    assert fault.yaml == f"sensors: {{F: {{gain: -1, runs: [{name}]}}}}" and fault.is_correctable


def test_a_force_that_is_late_in_one_run_is_compared_with_the_others() -> None:
    [fault] = faults(changed(runs(spring), "c", late))
    assert fault.kind == "delay" and fault.files == ("c",) and fault.serious and fault.is_correctable
    assert fault.value == pytest.approx(0.072, abs=1e-3)


def test_a_delay_in_all_runs_is_left_to_the_effects_of_sensors() -> None:
    some = runs(spring)
    for name in some:
        some = changed(some, name, lambda x: np.concatenate([np.full(3, x[0]), x[:-3]]))
    assert faults(some) == []


def test_runs_at_different_frequencies_do_not_decide_on_a_delay() -> None:
    """A damper whose phase differs from sine to sine has no delay."""
    motions = (sine(0.5, 0.01), sine(2.0, 2e-3), sine(2.0, 1e-4))
    assert faults(runs(lambda z, v: 2.0e4 * z + 200.0 * np.tanh(v / 0.01), motions)) == []
