"""Information of runs: the normal equations of a fit on them, and the noise that the weights are made for."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from railui.identification.context import Context, create_context
from railui.identification.estimation.free_parameters import free_parameters
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.problem import prepare_segments
from railui.planning.information import Information, collect_information
from railui.planning.planned_runs import planned_runs, simulate_runs
from railui.planning.store import ARRAYS, InformationStore
from railui.vehicle.model import Model
from tests.planning.files import plan_file

SENSORS = {"ayf": "0.02 m/s^2", "rf": "0.3 mrad/s", "d1": "0.02 mm"}


@cache
def context() -> Context:
    campaign = plan_file(SENSORS).campaign
    runs = planned_runs([30.0, 40.0], ["erri_b176_low seed=6"], 30.0)
    return create_context(simulate_runs(campaign, Model(campaign.design), runs, tuple(SENSORS)), jobs=2)


@cache
def information() -> Information:
    return collect_information(context())


def test_the_products_of_the_parameters_are_the_normal_equations_of_a_fit() -> None:
    found = information()
    model = context().nominal
    segments = prepare_segments(context(), model, context().dataset.estimation)
    free = free_parameters(context(), model, context().campaign.estimated_parameters)
    solver = GaussNewton(context(), model, free, segments)
    normal = solver.linearise(np.array([model.value(p) for p in free.paths])).total[1:, 1:]
    p = len(free.paths)
    total = sum(run.gram.sum(axis=0)[:p, :p] for run in found.runs)
    assert np.allclose(total, normal, rtol=1e-9, atol=1e-9 * np.abs(normal).max())


def test_the_noise_has_the_variance_that_the_weights_divide_by() -> None:
    for run in information().runs:
        assert run.noise / run.samples == pytest.approx(np.ones(3), rel=0.25)


def test_every_shape_of_the_library_has_a_row() -> None:
    found = information()
    kinds = {candidate.kind for candidate, _ in found.keys}
    assert {"free_play", "dry_friction", "creep_saturation", "sensor_delay", "spring"} <= kinds
    rows = len(found.free.paths) + len(found.keys)
    assert all(run.gram.shape == (3, rows, rows) for run in found.runs)


def test_the_effect_of_a_sensor_acts_on_its_channel_alone() -> None:
    found = information()
    row = len(found.free.paths) + next(
        i for i, (c, _) in enumerate(found.keys) if (c.kind, c.at) == ("sensor_gain", "rf")
    )
    lengths = found.runs[0].gram[:, row, row]
    acting = dict(zip(found.runs[0].channels, lengths > 1e-9 * lengths.max(), strict=True))
    assert acting == {"ayf": False, "rf": True, "d1": False}


def test_a_stored_run_is_read_back_to_the_last_bit_and_a_damaged_one_is_computed_again(tmp_path: Path) -> None:
    store = InformationStore(tmp_path / "store")
    computed, read = (collect_information(context(), store) for _ in range(2))
    files = sorted(store.directory.iterdir())
    assert len(files) == 2
    files[0].write_bytes(files[0].read_bytes()[:1000])
    again = collect_information(context(), store)
    for other in (read, again):
        assert other.keys == computed.keys
        for a, b in zip(computed.runs, other.runs, strict=True):
            assert a.channels == b.channels
            assert all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ARRAYS)


def test_other_noise_is_another_run(tmp_path: Path) -> None:
    store = InformationStore(tmp_path / "store")
    collect_information(context(), store)
    louder = replace(context(), dataset=replace(context().dataset, noise={**context().noise, "ayf": 0.1}))
    collect_information(louder, store)
    assert len(list(store.directory.iterdir())) == 4
