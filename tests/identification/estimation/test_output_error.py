"""Output-error estimation of a bogie and a rig from campaigns of the independent generator, whose truth is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.segment import Segment
from railui.campaign.settings.estimation import IdentifiabilitySettings
from railui.identification.context import create_context
from railui.identification.estimation import parallel_models
from railui.identification.estimation.block_products import block_gram
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.identifiability import parameter_flags
from railui.identification.estimation.noise_floor import estimate_noise_floor, noise_weights
from railui.identification.estimation.output_error import continue_fit, fit_output_error
from railui.identification.estimation.problem import prepare_segments
from railui.identification.estimation.validation import validate
from railui.identification.events import FitIteration
from railui.identification.prediction import DivergedError
from railui.progress import Progress
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.model import Model
from tests.blind.simulated import Request, calibrated, simulate_together, simulated_campaign
from tests.truth.files import paths
from tests.truth.rig import Bench
from tests.truth.rig import write as write_bench

FREE_PLAY = "free_play at=primary_lateral half_width=4e-4"
COACH_FORCES = {"seed": 4, "columns": ("Qy", "Qpsi")}


@pytest.fixture(scope="module", autouse=True)
def _simulated_together() -> None:
    simulate_together(Request(), Request((FREE_PLAY,)), Request(**COACH_FORCES))


def worst_decay(model: Model, speeds: set[float]) -> float:
    return max(float(model.eigenvalues(v)[0, 0].real) for v in speeds)


class Events(Progress):
    """Events of a fit."""

    def __init__(self) -> None:
        self.events: list[FitIteration] = []

    def event(self, event: object) -> None:
        """Collect an event."""
        assert isinstance(event, FitIteration)
        self.events.append(event)


def optimiser_of(fit) -> GaussNewton:
    context = simulated_campaign().context
    return GaussNewton.of_fit(context, fit)


def test_every_run_of_a_campaign_has_its_own_noise():
    m, declared = simulated_campaign().dataset, simulated_campaign().nominal
    assert [s.run_index for s in m.segments] == [0, 1]
    first = m.estimation[0]
    own, other = (
        noise_weights(simulated_campaign().context, declared, s) for s in (first, replace(first, run_index=1))
    )
    assert np.all(own != other)
    np.testing.assert_allclose(own, other, rtol=0.2)


def test_the_calibrated_model_is_as_accurate_as_the_true_parameters():
    case, fit = simulated_campaign(), calibrated()
    assert validate(case.context, fit.model, case.dataset.validation).nrmse == pytest.approx(case.true_error, rel=0.02)


def test_runs_may_measure_different_channels():
    context, fit = simulated_campaign().context, calibrated()
    first, second = context.dataset.segments
    few, more = ([c for c in first.channels if c not in without] for without in (("rf",), ("d1", "e1")))
    assert len(few) != len(more)

    def only(segment: Segment, names: list[str]) -> Segment:
        own = {k: x for k, x in segment.columns.items() if k not in segment.channels or k in names}
        return replace(segment, columns=own, role="adjust", tables={})

    prepared = prepare_segments(context, fit.model, [only(first, few), only(second, more)])
    lines = Events()
    quiet = replace(context, progress=lines)
    optimiser = GaussNewton.of_fit(quiet, fit, prepared)
    normal = optimiser.linearise(fit.x)
    assert set(optimiser.channels) == set(few) | set(more) and normal.gram.shape[1] == len(optimiser.channels)
    alone = [GaussNewton.of_fit(quiet, fit, [t]).linearise(fit.x) for t in prepared]
    assert normal.total == pytest.approx(alone[0].total + alone[1].total, rel=1e-12)
    optimiser.fit(fit.x, tolerance=1e-3, max_iterations=0, normal=normal)
    [event] = lines.events
    rf = optimiser.channels.index("rf")
    i = more.index("rf")
    expected = np.sqrt(normal.gram[:, rf, 0, 0].sum() / np.sum(prepared[1].measured[i] ** 2))
    assert event.channels["rf"] == pytest.approx(expected)


def test_the_noise_floor_is_the_error_of_the_true_parameters():
    # 45 s scatter by 2 %, the estimated levels of the noise by 4 %
    case = simulated_campaign()
    error = validate(case.context, case.true_model, case.dataset.segments).nrmse
    floor = estimate_noise_floor(case.context, case.true_model, case.dataset.segments).nrmse
    assert error == pytest.approx(floor, rel=0.10)


def test_calibration_lowers_the_error_of_the_nominal_model():
    case, fit = simulated_campaign(), calibrated()
    declared = validate(case.context, case.nominal, case.dataset.validation).nrmse
    assert validate(case.context, fit.model, case.dataset.validation).nrmse < 0.5 * declared


def test_observable_parameters_lie_within_four_standard_deviations():
    truth, fit = paths(simulated_campaign().truth.vehicle), calibrated()
    seen = [i for i, flag in enumerate(parameter_flags(fit, IdentifiabilitySettings())) if flag != "unseen"]
    off = {fit.free.paths[i]: (fit.x[i] - truth[fit.free.paths[i]]) / fit.sd[i] for i in seen}
    assert len(seen) >= 10
    assert {path: round(x, 1) for path, x in off.items() if abs(x) > 4.0} == {}


def test_unobservable_parameters_stay_near_their_nominal_values():
    case, fit = simulated_campaign(), calibrated()
    values = case.nominal.design.values
    for path, x, sd in zip(fit.free.paths, fit.x, fit.free.prior_sd, strict=True):
        if np.isfinite(sd):
            assert abs(x - values[path]) < 4.0 * sd, path


@pytest.mark.parametrize(("is_coarse", "tolerance"), [(True, 1e-3), (False, 5e-3)])
def test_sensitivities_equal_central_differences(is_coarse: bool, tolerance: float) -> None:
    """With their own steps, and nearly with those of the residual, whose damped modes are integrated more finely."""
    fit = calibrated()
    by_hand = optimiser_of(fit)
    delta = 1e-3 * np.maximum(np.abs(fit.x), 0.1 * fit.free.size)
    tried = np.vstack([fit.x + np.diag(delta), fit.x - np.diag(delta)])
    p, gram = len(fit.x), 0.0
    for target in fit.segments:
        assert target.sensitivity_steps < target.steps
        [residual] = target.measured - by_hand.simulate(target, fit.x[None]).series
        z, _ = by_hand.simulate(target.for_differences if is_coarse else target, tried)
        rows = [residual, *((z[:p] - z[p:]) / (2.0 * delta[:, None, None]))]
        flat = np.stack(rows).reshape(p + 1, -1)
        gram = gram + flat @ flat.T
    total = optimiser_of(fit).linearise(fit.x).total
    length = np.sqrt(np.diag(gram))
    assert np.abs(total / np.outer(length, length) - gram / np.outer(length, length)).max() < tolerance


def test_inner_products_of_blocks_add_up_to_the_total():
    series = np.random.default_rng(0).standard_normal((5, 3, 103))
    found = block_gram(series, 10)
    assert found.shape == (11, 3, 5, 5)
    np.testing.assert_allclose(found.sum(axis=(0, 1)), np.einsum("icn,jcn->ij", series, series), rtol=1e-12)
    np.testing.assert_allclose(found[2, 1], series[:, 1, 20:30] @ series[:, 1, 20:30].T, rtol=1e-12)


def test_a_fit_returns_no_unstable_vehicle():
    # without clearance in the model the primary stiffness diverges
    fit = calibrated(FREE_PLAY)
    speeds = {v for t in fit.segments for v in t.segment.speeds}
    assert worst_decay(fit.model, speeds) < 0.0


def test_a_slightly_unstable_nominal_model_is_calibrated_to_a_stable_one():
    case, fit = simulated_campaign(), calibrated()
    speeds = {v for t in fit.segments for v in t.segment.speeds}
    found = dict(zip(fit.free.paths, fit.x, strict=True))
    hunting = Model(case.nominal.design.with_values({p: 2.5 * x for p, x in found.items() if p.endswith("conicity")}))
    assert worst_decay(hunting, speeds) > 0.0
    again = calibrate(replace(case.context, nominal=hunting))
    assert worst_decay(again.model, speeds) < 0.0
    assert again.normal.rss == pytest.approx(fit.normal.rss, rel=0.05)


def test_a_measured_force_of_the_carbody_drives_the_vehicle():
    case = simulated_campaign(**COACH_FORCES)
    fit = calibrate(case.context)
    segments = case.dataset.validation
    assert segments[0].coach_forces == ("Qy", "Qpsi")
    error, noise = (
        validate(case.context, fit.model, segments).nrmse,
        estimate_noise_floor(case.context, fit.model, segments).nrmse,
    )
    assert error < 1.15 * noise


@pytest.mark.parametrize("free", [False, True])
def test_stiffness_and_damping_of_a_rig_are_estimated(tmp_path: Path, free: bool):
    true = write_bench(Bench(seed=5, free=free, seconds=(4.0, 3.0)), tmp_path)
    dataset = read_dataset(load_campaign(tmp_path))
    fit = calibrate(create_context(dataset, jobs=2))
    found = dict(zip(fit.free.paths, fit.x, strict=True))
    assert found["vehicle.rig.stiffness"] == pytest.approx(true.k, rel=0.01)
    assert found["vehicle.rig.damping"] == pytest.approx(true.c, rel=0.05)


def test_a_long_record_of_a_rig_has_the_weights_of_a_short_one(tmp_path: Path):
    write_bench(Bench(seed=5, seconds=(4.0, 3.0)), tmp_path)
    dataset = read_dataset(load_campaign(tmp_path))
    (short,) = dataset.estimation
    many = -(-100_000 // short.samples)
    columns = {c: np.tile(x, many) for c, x in short.columns.items()}
    columns["t"] = np.arange(many * short.samples) * short.dt
    long = replace(short, columns=columns, tables={})
    model = Model(dataset.campaign.design)
    context = create_context(dataset)
    assert noise_weights(context, model, long) == pytest.approx(noise_weights(context, model, short), rel=0.05)


def test_a_fit_with_a_sensor_effect_is_independent_of_the_number_of_jobs():
    case, fit = simulated_campaign(), calibrated()
    late = case.dataset.estimation[0]
    columns = dict(late.columns) | {"e1": np.interp(late.columns["t"] - 0.01, late.columns["t"], late.columns["e1"])}
    segment = replace(late, columns=columns, tables={})
    dataset = replace(case.dataset, segments=(segment, *case.dataset.validation))
    model = replace(fit.model, sensors=(PlacedEffect("sensor_delay", "e1", None, {"delay": 0.0}),))
    free = [*fit.free.paths, "sensors.0.delay"]
    first, second = (
        fit_output_error(create_context(dataset, jobs=jobs), model, free, max_iterations=6) for jobs in (1, 2)
    )
    assert first.x[-1] == pytest.approx(0.01, abs=5e-4)
    np.testing.assert_array_equal(first.x, second.x)
    np.testing.assert_array_equal(first.covariance, second.covariance)


class DivergesOnce(GaussNewton):
    """Optimiser next to whose first new point the vehicle diverges."""

    refused: np.ndarray | None = None
    start: np.ndarray | None = None

    def linearise(self, x):
        if self.start is None:
            self.start = x
        elif self.refused is None:
            self.refused, self.segments = x, []
            raise DivergedError("the vehicle diverges")
        return super().linearise(x)


def test_a_point_next_to_which_the_vehicle_diverges_is_not_taken():
    fit = calibrated()
    start = fit.x * (1.0 + 0.02 * np.cos(np.arange(len(fit.x))))
    context = simulated_campaign().context
    optimiser = DivergesOnce(context, fit.model, fit.free, fit.segments, block=1.0, stable=False)
    found = optimiser.fit(start, tolerance=0.5, max_iterations=1)
    misfits = optimiser_of(fit).misfit(np.stack([start, found.x, optimiser.refused]))
    assert misfits[2] < misfits[1] < misfits[0]
    assert len(found.segments) == len(fit.segments)


def test_a_fit_next_to_whose_better_points_the_vehicle_diverges_has_not_converged():
    fit = calibrated()
    start = fit.x * (1.0 + 0.02 * np.cos(np.arange(len(fit.x))))
    optimiser = DivergesOnce(simulated_campaign().context, fit.model, fit.free, fit.segments, block=1.0, stable=False)
    optimiser.misfit = lambda x: np.where(np.arange(len(x)) > 0, np.inf, 0.5 * optimiser_of(fit).misfit(x[:1]))
    found = optimiser.fit(start, tolerance=1e-6)
    assert np.array_equal(found.x, start) and found.status == "diverges next to every better point"


@pytest.mark.parametrize(("sweeps", "status"), [(1, "iterations"), (25, "converged")])
def test_two_parallel_models_converge_only_where_a_sweep_gains_nothing(monkeypatch, sweeps: int, status: str):
    fit = calibrated()
    monkeypatch.setattr(parallel_models, "MAX_SWEEPS", sweeps)
    monkeypatch.setattr(parallel_models, "_step", lambda o, x, j, cost: (x, cost - 1e3 if sweeps == 1 else cost))
    found = parallel_models.two_parallel_models(simulated_campaign().context, fit.model, fit.segments)
    assert found.status == status and found.iterations == 1


def fitted_from_nominal(max_iterations: int, **options):
    context, whole = simulated_campaign().context, calibrated()
    names = whole.free.paths[:4]
    return fit_output_error(
        context, context.nominal, names, segments=whole.segments, max_iterations=max_iterations, **options
    )


def test_a_continued_fit_takes_the_steps_of_one_without_a_pause():
    paused, whole = fitted_from_nominal(2), fitted_from_nominal(4)
    continued = continue_fit(
        simulated_campaign().context, paused, paused.segments, tolerance=1e-6, max_iterations=whole.iterations - 2
    )
    assert np.array_equal(continued.x, whole.x) and continued.normal.rss == whole.normal.rss
    assert continued.simulations + paused.simulations == whole.simulations


def test_a_fit_ends_where_its_limit_of_the_misfit_is_out_of_reach():
    whole = fitted_from_nominal(30)
    ended = fitted_from_nominal(30, misfit_limit=0.5 * whole.normal.rss)
    assert ended.status == "above the limit" and ended.iterations < whole.iterations
    assert ended.normal.rss >= whole.normal.rss
    within = fitted_from_nominal(30, misfit_limit=1.5 * whole.normal.rss)
    assert within.status == whole.status and np.array_equal(within.x, whole.x)
