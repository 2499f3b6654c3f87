"""Residuals that several channels share but that follow no motion: a changing contact, or noise of the track."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from railui.campaign.dataset import Dataset
from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.loop import close_loop
from railui.identification.unmodelled.discrepancy import Discrepancy, DiscrepancyCurve
from railui.identification.unmodelled.location_evidence import LocationEvidence, joint_of
from railui.identification.unmodelled.search import _is_force_on_vehicle, may_be_track_noise
from tests.blind.draw import draw_trial
from tests.blind.simulated import recorded
from tests.truth.campaign import Order, campaigns
from tests.truth.effects import Effect, effect

WET_PATCHES = effect("wet_patches", "contact", depth=0.6, length=150.0)
SLIGHTLY_WET_PATCHES = effect("wet_patches", "contact", depth=0.4, length=150.0)
CROSSED_DAMPING = effect("crossed_damping", "wheelset", damping=2e4)
ACCELEROMETERS = ("ay1", "ay2", "ayf")
DISPLACEMENTS = ("e1", "e2", "d1", "d2")
BRIEF = {"seed": 47047, "seconds": (40.0, 30.0)}  # s


def damper(damping: float) -> Effect:
    """A damper of one wheelset."""
    return effect("viscous_damper", "primary_lateral", 1, damping=damping)


ORDERS = {
    "wet patches": Order(effects=(WET_PATCHES,), without=ACCELEROMETERS, **BRIEF),
    "slightly wet patches": Order(effects=(SLIGHTLY_WET_PATCHES,), without=ACCELEROMETERS, **BRIEF),
    "crossed damping": Order(effects=(CROSSED_DAMPING,), without=ACCELEROMETERS, **BRIEF),
    "noisy displacements": Order(without=ACCELEROMETERS, stated=1.0 / 3.0, **BRIEF),
    "noisy accelerations": Order(without=(*DISPLACEMENTS, "rf"), stated=1.0 / 3.0, **BRIEF),
    "damper": Order(effects=(damper(2.3e4),), without=DISPLACEMENTS, stated=0.0, **{**BRIEF, "seed": 3}),
}


@pytest.fixture(scope="module")
def datasets() -> dict[str, Dataset]:
    """Campaigns of the orders, simulated side by side in about the time of the longest."""
    return dict(zip(ORDERS, map(recorded, campaigns(list(ORDERS.values()))), strict=True))


def test_patches_of_low_friction_are_no_noise(datasets: dict[str, Dataset]) -> None:
    """They change the phase of the motion along the track, so that the residual is coherent with none."""
    result = close_loop(datasets["wet patches"], jobs=2)
    assert not result.remainder.coherent and not result.remainder.structured
    assert result.validations["after"].nrmse > 3.0 * result.noise_floor.nrmse
    assert result.verdict == "outside" and result.discrepancy is not None and result.discrepancy.at == "contact"


@pytest.mark.parametrize(
    ("missing", "least_ratio", "largest_ratio", "is_structured"),
    [
        ("slightly wet patches", 1.5, 3.0, False),  # the stated noise may be wrong by 3, but the relations determine it
        ("crossed damping", 1.11, 1.5, True),  # a tenth of the error and a structure count
    ],
)
def test_a_small_discrepancy_is_no_noise_of_the_track(
    missing: str, least_ratio: float, largest_ratio: float, is_structured: bool, datasets: dict[str, Dataset]
) -> None:
    result = close_loop(datasets[missing], jobs=2)
    assert least_ratio < result.error_to_noise < largest_ratio and result.remainder.structured == is_structured
    assert result.verdict == "outside" and result.discrepancy is not None
    assert joint_of(result.discrepancy.at) == "contact"


@pytest.mark.parametrize("recorded", ["displacements", "accelerations"])
def test_noise_of_three_times_the_stated_size_is_no_discrepancy(datasets: dict[str, Dataset], recorded: str) -> None:
    """That of the track reaches all channels alike."""
    result = close_loop(datasets[f"noisy {recorded}"], jobs=2)
    assert (result.verdict, result.discrepancy) == ("none", None)


def test_the_noise_of_the_track_is_known_from_what_an_effect_leaves(datasets: dict[str, Dataset]) -> None:
    """No noise is stated, so that what the damper leaves would else be half as large again as the noise floor."""
    result = close_loop(datasets["damper"], jobs=2)
    [added] = result.after.model.effects
    assert (added.kind, added.at, added.wheelset) == ("viscous_damper", "primary_lateral", 1)
    assert result.verdict == "effect" and result.has_track_noise
    assert result.error_to_noise == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_a_damper_too_small_to_be_selected_and_noise_of_the_track_are_no_discrepancy() -> None:
    small = Order(effects=(damper(1.2e4),), without=DISPLACEMENTS, stated=0.0, **BRIEF)
    result = close_loop(recorded(campaigns([small])[0]), jobs=2)
    assert result.score_test.rho2 > LoopSettings().score_test.obvious_rho2
    assert (result.verdict, result.discrepancy) == ("none", None) and result.has_track_noise


@pytest.mark.slow
def test_a_residual_with_an_obvious_score_is_no_noise_of_the_track() -> None:
    """Friction that ages: hysteresis explains most of the estimation run, and nothing of the validation run."""
    case = next(c for c in draw_trial(165, 74000, (70.0, 45.0)) if c.order.seed == 74108)
    result = close_loop(recorded(campaigns([case.order])[0]), jobs=2)
    assert result.verdict == "outside" and not result.has_track_noise


@pytest.mark.parametrize(("rho2", "may_be_noise"), [(0.1, True), (0.3, False)])
def test_an_obvious_score_that_no_effect_explains_is_no_noise_of_the_track(rho2: float, may_be_noise: bool) -> None:
    curve = DiscrepancyCurve("z", np.zeros(2), np.zeros(2), np.zeros(2), "m", "N")
    found = Discrepancy("contact", None, curve, 0.7, cast(Any, None), cast(Any, None))
    dataset, campaign = SimpleNamespace(selection=[]), SimpleNamespace(min_gain=0.19)
    context = SimpleNamespace(settings=LoopSettings(), dataset=dataset, campaign=campaign)
    selection = SimpleNamespace(final_score_test=SimpleNamespace(rho2=rho2), steps=())
    not_used = cast(Any, None)
    assert may_be_track_noise(cast(Any, context), found, cast(Any, selection), not_used, not_used) is may_be_noise


@pytest.mark.parametrize(
    ("locations", "contact_share", "is_on_vehicle"),
    [
        (("primary_yaw",), 0.5, True),
        (("primary_yaw", "secondary_lateral"), 0.5, True),
        (("primary_yaw", "wheelset_yaw"), 0.5, False),
        (("wheelset",), 0.5, False),
        (("primary_yaw",), 0.85, False),  # the contact explains nearly as much
        ((), 0.0, False),
    ],
)
def test_only_a_force_away_from_the_contact_is_no_noise_of_the_track(locations, contact_share, is_on_vehicle) -> None:
    evidence = LocationEvidence(0.9, 0.01)
    discrepancy = SimpleNamespace(
        evidence=evidence,
        contact_share=contact_share,
        locations=lambda settings: [(at, None, evidence) for at in locations],
    )
    assert _is_force_on_vehicle(SimpleNamespace(settings=LoopSettings()), discrepancy) is is_on_vehicle


@pytest.mark.parametrize(("law", "is_located"), [({}, False), ({"drift": True}, True), ({"lowers_error": True}, True)])
def test_forces_locate_nothing_where_the_calibration_failed(law: dict[str, Any], is_located: bool) -> None:
    none, settings = cast(Any, None), LoopSettings().verdict
    curve = DiscrepancyCurve("z", np.zeros(2), np.zeros(2), np.zeros(2), "m", "N")
    found = Discrepancy("frame", None, curve, 0.7, none, none, evidence=LocationEvidence(0.7, 0.03), **law)
    assert found.is_located(settings) and found.without_calibration().is_located(settings) is is_located
