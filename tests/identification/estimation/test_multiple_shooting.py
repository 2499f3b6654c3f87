"""Multiple shooting: a vehicle that hunts between its flanges, fitted on windows with separate initial states."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.context import Context, create_context
from railui.identification.estimation import multiple_shooting
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.multiple_shooting import cut_into_windows, max_growth_rate, windowed_files
from railui.identification.estimation.problem import estimate_window_start, prepare_segments
from railui.identification.estimation.validation import validate
from railui.identification.loop import close_loop
from railui.identification.prediction import DivergedError
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.model import Model
from tests.truth.bogie import Vehicle
from tests.truth.campaign import DECLARED, Order, campaign, write
from tests.truth.effects import parse

FLANGES = {"clearance": 0.005, "stiffness": 3e7}
HUNTS: Vehicle = replace(DECLARED, lam=(0.21, 0.20), kappa_x=(190.0, 185.0), kappa_y=(170.0, 160.0))


@pytest.fixture(scope="module")
def hunting(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """60 m/s is above, 50 m/s below the linear critical speed; the flanges limit the motion."""
    words = "flange_contact at=contact " + " ".join(f"{k}={v}" for k, v in FLANGES.items())
    order = Order([parse(words)], seed=5, seconds=(30.0, 20.0), speeds=(60.0, 50.0), vehicle=HUNTS)
    folder = tmp_path_factory.mktemp("hunting")
    write(campaign(order), folder)
    return read_dataset(load_campaign(folder))


def with_flanges(dataset: Dataset) -> Context:
    flanges = PlacedEffect("flange_contact", "contact", None, FLANGES)
    context = create_context(dataset)
    return replace(context, nominal=context.nominal.with_effect(flanges))


def test_windows_share_the_track_of_the_segment(hunting: Dataset):
    (whole,) = hunting.estimation
    cut = whole.windows(3.0)
    assert np.array_equal(np.concatenate([w.columns["e1"] for w in cut]), whole.columns["e1"])
    behind = Model(hunting.campaign.design).wheelset_spacing()
    table = whole.table(behind, 2)
    assert np.array_equal(cut[5].table(behind, 2)[0], table[4 * cut[5].first_sample])
    assert cut[5].table(behind, 2).shape[0] == 4 * (cut[5].samples - 1) + 1


def test_the_initial_state_of_a_window_is_projected_out(hunting: Dataset):
    model = Model(hunting.campaign.design)
    (whole,) = hunting.estimation
    context = create_context(hunting)
    ready = prepare_segments(context, model, cut_into_windows([whole], {whole.segment_key.name}, 3.0))[3]
    window = estimate_window_start(context, model, ready)
    assert window.initial_sensitivity is not None
    made = np.tensordot(
        np.linspace(-1.0, 1.0, len(window.initial_sensitivity.rows)), window.initial_sensitivity.rows, 1
    )
    # the prior of typical motions retains a little of the directions that the sensors hardly observe
    assert np.sum(window.without_initial_state(made) ** 2) < 1e-4 * np.sum(made**2)


def test_the_initial_state_of_a_window_does_not_depend_on_the_state_it_is_corrected_from(hunting: Dataset) -> None:
    """With a ridge on the corrections, states that the window hardly determines would grow with each of them."""
    context, model = create_context(hunting), Model(hunting.campaign.design)
    (whole,) = hunting.estimation
    ready = prepare_segments(context, model, cut_into_windows([whole], {whole.segment_key.name}, 3.0))[5]
    once = estimate_window_start(context, model, ready)
    often = estimate_window_start(context, model, ready, corrections=30)
    assert np.allclose(often.initial_state, once.initial_state, rtol=1e-3, atol=1e-6)


def test_a_window_on_which_the_vehicle_diverges_refuses_the_point(hunting: Dataset):
    (whole,) = hunting.estimation
    context, model = create_context(hunting), Model(hunting.campaign.design)
    ready = prepare_segments(context, model, cut_into_windows([whole], {whole.segment_key.name}, 3.0))[3]
    diverging = model.with_path_values(["vehicle.secondary.lateral_damping"], np.array([1e9]))
    with pytest.raises(DivergedError, match=r"diverges on run_a\.csv\.gz at 9 s"):
        estimate_window_start(context, diverging, ready)


def test_a_hunting_vehicle_with_nominal_flanges_is_calibrated(hunting: Dataset):
    context = with_flanges(hunting)
    low = [f"contact.{w}.conicity" for w in ("leading", "trailing")]
    fit = calibrate(replace(context, nominal=context.nominal.with_path_values(low, np.array([0.2, 0.2]))))
    assert max_growth_rate(fit.model, hunting.estimation[0]) > 0.0
    assert not fit.constrained and windowed_files(fit) == ["run_a.csv.gz"]
    found = dict(zip(fit.free.paths, fit.x, strict=True))
    assert found[low[1]] == pytest.approx(0.20, rel=0.10)
    assert found["vehicle.primary.lateral_stiffness"] == pytest.approx(3e6, rel=0.05)
    assert validate(context, fit.model, hunting.validation).nrmse < 0.3


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_unmodelled_flanges_are_found(hunting: Dataset):
    found = close_loop(hunting)
    assert "flange_contact" in [e.kind for e in found.after.model.effects]
    assert found.before.constrained and found.windowed is not None
    assert found.validations["after"].nrmse < 0.1 < 0.5 < found.validations["before"].nrmse


def test_windows_on_which_the_fit_diverges_leave_the_fit_over_whole_runs(
    hunting: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    def diverge(*given: object, **options: object) -> None:
        raise DivergedError("the vehicle diverges on run_a.csv.gz at a point of the fit")

    before = SimpleNamespace(model=Model(hunting.campaign.design), constrained=True)
    monkeypatch.setattr(multiple_shooting, "fit_output_error", diverge)
    monkeypatch.setattr(multiple_shooting, "prepare_segments", lambda *given: [])
    assert multiple_shooting.refit_hunting(create_context(hunting), before) == (before, None)  # type: ignore[arg-type]
