"""Adjustment of a bogie and of a rig to campaigns of the independent generator, whose truth is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.estimation.block_products import block_gram
from railui.identification.estimation.output_error import GaussNewton, fit_output_error
from railui.identification.estimation.validation import estimate_noise_floor, noise_weights, validate
from railui.identification.loop import calibrate
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.model import Model
from tests.blind.made import calibrated, simulated_campaign
from tests.truth.files import paths
from tests.truth.rig import Bench
from tests.truth.rig import write as write_bench

FREE_PLAY = "free_play at=primary_lateral half_width=4e-4"


def worst_decay(model: Model, speeds: set[float]) -> float:
    return max(float(model.eigenvalues(v)[0, 0].real) for v in speeds)


def adjuster_of(fit) -> GaussNewton:
    return GaussNewton(fit.model, fit.free, fit.targets, block=1.0, stable=False, jobs=1)


def test_every_run_of_a_campaign_draws_noise_of_its_own():
    m, declared = simulated_campaign().dataset, simulated_campaign().nominal
    assert [s.run_index for s in m.segments] == [0, 1]
    first = m.estimation[0]
    own, other = (noise_weights(declared, m, s) for s in (first, replace(first, run=1)))
    assert np.all(own != other)
    np.testing.assert_allclose(own, other, rtol=0.2)


def test_the_adjusted_vehicle_leaves_what_noise_leaves():
    one, fit = simulated_campaign(), calibrated()
    error = validate(fit.model, one.dataset, one.dataset.validation).nrmse
    assert error == pytest.approx(
        estimate_noise_floor(fit.model, one.dataset, one.dataset.validation).nrmse, rel=0.10
    )


def test_adjusting_lowers_the_error_of_the_declared_vehicle():
    one, fit = simulated_campaign(), calibrated()
    declared = validate(one.nominal, one.dataset, one.dataset.validation).nrmse
    assert validate(fit.model, one.dataset, one.dataset.validation).nrmse < 0.5 * declared


def test_true_parameters_lie_within_four_deviations_where_the_sensors_see_them():
    truth, fit = paths(simulated_campaign().truth.vehicle), calibrated()
    seen = [i for i, flag in enumerate(fit.flags()) if flag != "unseen"]
    off = {fit.free.paths[i]: (fit.x[i] - truth[fit.free.paths[i]]) / fit.sd[i] for i in seen}
    assert len(seen) >= 10
    assert {path: round(x, 1) for path, x in off.items() if abs(x) > 4.0} == {}


def test_what_the_sensors_do_not_see_is_held_near_the_declared_value():
    one, fit = simulated_campaign(), calibrated()
    values = one.nominal.design.values
    for path, x, sd in zip(fit.free.paths, fit.x, fit.free.prior_sd, strict=True):
        if np.isfinite(sd):
            assert abs(x - values[path]) < 4.0 * sd, path


def test_sensitivities_equal_central_differences():
    fit = calibrated()
    by_hand = adjuster_of(fit)
    delta = 1e-3 * np.maximum(np.abs(fit.x), 0.1 * fit.free.size)
    tried = np.vstack([fit.x, fit.x + np.diag(delta), fit.x - np.diag(delta)])
    p, gram = len(fit.x), 0.0
    for target in fit.segments:
        z, _ = by_hand.simulate(target, tried)
        rows = [target.measured - z[0], *((z[1 : p + 1] - z[p + 1 :]) / (2.0 * delta[:, None, None]))]
        flat = np.stack(rows).reshape(p + 1, -1)
        gram = gram + flat @ flat.T
    total = adjuster_of(fit).linearise(fit.x).total
    length = np.sqrt(np.diag(gram))
    assert np.abs(total / np.outer(length, length) - gram / np.outer(length, length)).max() < 1e-3


def test_inner_products_of_blocks_add_up_to_the_whole():
    series = np.random.default_rng(0).standard_normal((5, 3, 103))
    found = block_gram(series, 10)
    assert found.shape == (11, 3, 5, 5)
    np.testing.assert_allclose(found.sum(axis=(0, 1)), np.einsum("icn,jcn->ij", series, series), rtol=1e-12)
    np.testing.assert_allclose(found[2, 1], series[:, 1, 20:30] @ series[:, 1, 20:30].T, rtol=1e-12)


def test_a_fit_does_not_return_a_vehicle_that_hunts():
    # without the free play in the model the primary stiffness runs away
    fit = calibrated(FREE_PLAY)
    speeds = {v for t in fit.segments for v in t.segment.speeds}
    assert worst_decay(fit.model, speeds) < 0.0


def test_a_declared_vehicle_that_hunts_a_little_is_adjusted_to_a_stable_one():
    one, fit = simulated_campaign(), calibrated()
    speeds = {v for t in fit.segments for v in t.segment.speeds}
    found = dict(zip(fit.free.paths, fit.x, strict=True))
    hunting = Model(one.nominal.design.with_values({p: 2.5 * x for p, x in found.items() if p.endswith("conicity")}))
    assert worst_decay(hunting, speeds) > 0.0
    again = calibrate(one.dataset, hunting, jobs=2)
    assert worst_decay(again.model, speeds) < 0.0
    assert again.normal.rss == pytest.approx(fit.normal.rss, rel=0.05)


def test_a_measured_force_of_the_coach_drives_the_vehicle():
    one = simulated_campaign(seed=4, columns=("Qy", "Qpsi"))
    fit = calibrate(one.dataset, one.nominal, jobs=2)
    validate = one.dataset.validation
    assert validate[0].coach_forces == ("Qy", "Qpsi")
    error, noise = (
        validate(fit.model, one.dataset, validate).nrmse,
        estimate_noise_floor(fit.model, one.dataset, validate).nrmse,
    )
    assert error < 1.15 * noise


@pytest.mark.parametrize("free", [False, True])
def test_a_rig_is_adjusted_to_its_true_stiffness_and_damping(tmp_path: Path, free: bool):
    true = write_bench(Bench(seed=5, free=free, seconds=(4.0, 3.0)), tmp_path)
    measurement = read_dataset(load_campaign(tmp_path))
    fit = calibrate(measurement, Model(measurement.campaign.design), jobs=2)
    found = dict(zip(fit.free.paths, fit.x, strict=True))
    assert found["vehicle.rig.stiffness"] == pytest.approx(true.k, rel=0.01)
    assert found["vehicle.rig.damping"] == pytest.approx(true.c, rel=0.05)


def test_a_long_record_of_a_rig_is_weighted_as_a_short_one(tmp_path: Path):
    write_bench(Bench(seed=5, seconds=(4.0, 3.0)), tmp_path)
    measurement = read_dataset(load_campaign(tmp_path))
    (short,) = measurement.estimation
    many = -(-100_000 // short.samples)
    columns = {c: np.tile(x, many) for c, x in short.columns.items()}
    columns["t"] = np.arange(many * short.samples) * short.dt
    long = replace(short, columns=columns, tables={})
    model = Model(measurement.campaign.design)
    assert noise_weights(model, measurement, long) == pytest.approx(noise_weights(model, measurement, short), rel=0.05)


def test_a_sensor_is_adjusted_along_and_the_digits_do_not_depend_on_the_number_of_jobs():
    one, fit = simulated_campaign(), calibrated()
    late = one.dataset.estimation[0]
    columns = dict(late.columns) | {"e1": np.interp(late.columns["t"] - 0.01, late.columns["t"], late.columns["e1"])}
    stretch = replace(late, columns=columns, tables={})
    measurement = replace(one.dataset, segments=(stretch, *one.dataset.validation))
    model = replace(fit.model, sensors=(PlacedEffect("sensor_delay", "e1", None, {"delay": 0.0}),))
    free = [*fit.free.paths, "sensors.0.delay"]
    first, second = (fit_output_error(model, measurement, free, one.nominal, most=6, jobs=jobs) for jobs in (1, 2))
    assert first.x[-1] == pytest.approx(0.01, abs=5e-4)
    np.testing.assert_array_equal(first.x, second.x)
    np.testing.assert_array_equal(first.covariance, second.covariance)
