"""The verdict in words."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.estimation.validation import Validation
from railui.identification.residual.restoring_force_surface import SurfaceShares
from railui.identification.result import IndependentTest, LoopResult
from railui.identification.structure.freed_groups import FreedGroups
from railui.identification.structure.group_test import GroupDifference
from railui.identification.unmodelled.location_evidence import NO_EVIDENCE
from railui.identification.unmodelled.run_dependence import RunDependence, RunEstimate
from railui.identification.verdict import Explained, Remainder
from railui.report.loop.groups import group_lines
from railui.report.loop.sentence import run_dependence_text, sentence
from railui.vehicle.effects import PlacedEffect

PLAY = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 4.4514e-4})
FRICTION = PlacedEffect("dry_friction", "secondary_yaw", None, {"force": 510.0, "slip_speed": 1e-3})
NOTHING_LEFT = Remainder(0.0, 0.0, coherent=False, structured=False)
SD = {"effects.0.half_width": 2.6e-6}


def fit(*effects: PlacedEffect) -> Any:
    paths, sd = list(SD), SimpleNamespace(tolist=lambda: list(SD.values()))
    model = SimpleNamespace(design=SimpleNamespace(effects=effects, structure=None), sensors=(), effects=effects)
    return SimpleNamespace(free=SimpleNamespace(paths=paths), sd=sd, model=model)


def result(
    verdict: str,
    *effects: PlacedEffect,
    ratio: float = 1.01,
    discrepancy: Any = None,
    remainder: Remainder = NOTHING_LEFT,
    share: float = 0.996,
    source: str = "both",
    hum: dict[tuple[str, str], float] | None = None,
) -> LoopResult:
    fields = {
        "is_failed_fit": False,
        "is_out_of_time": False,
        "explained": Explained(share, 0.004),
        "remainder": remainder,
        "context": SimpleNamespace(settings=LoopSettings()),
        "dataset": SimpleNamespace(hum=hum or {}),
        "verdict": verdict,
        "validations": {"before": SimpleNamespace(nrmse=0.3514), "after": SimpleNamespace(nrmse=0.0541, diverged=())},
        "noise_floor": SimpleNamespace(nrmse=0.0533, source=source),
        "error_to_noise": ratio,
        "after": fit(*effects),
        "nominal": fit().model,
        "discrepancy": discrepancy,
        "test": None,
        "conditions": None,
        "is_by_condition": False,
        "sensitive_motion": None,
    }
    return cast(LoopResult, SimpleNamespace(**fields))


def test_an_effect_is_named_with_location_value_and_errors() -> None:
    assert sentence(result("effect", PLAY)) == (
        "Most likely unmodelled effect: clearance in the lateral primary suspension of both wheelsets, half-width "
        "0.445 +/- 0.003 mm. Validation error 0.351 -> 0.054; expected from noise alone 0.053."
    )


def test_effects_that_the_independent_test_contradicts_are_said_to_be() -> None:
    contradicted = result("partial", PLAY)
    contradicted.test = IndependentTest(0.196, 0.243, 0.044, ("c.csv",), True, is_contradicted=True)  # type: ignore[misc]
    text = "The independent test contradicts the effects: its error rises, 0.196 -> 0.243."
    assert sentence(contradicted).endswith(text) and text not in sentence(result("partial", PLAY))


def test_two_effects_are_named_in_the_plural() -> None:
    text = sentence(result("effect", PLAY, FRICTION))
    assert text.startswith("Most likely unmodelled effects: clearance in ")
    assert "; and dry friction in the secondary suspension in yaw, force 510 N*m, slip speed 1 mrad/s." in text


def test_no_effect_is_no_more_than_not_detected() -> None:
    assert sentence(result("none")) == (
        "No unmodelled effect detected. Validation error 0.054; expected from noise alone 0.053."
    )


@pytest.mark.parametrize(
    ("source", "known"), [("stated", "stated"), ("both", "stated"), ("estimated", "estimated from the runs")]
)
def test_a_large_incoherent_residual_is_noise_larger_than_known(source: str, known: str) -> None:
    text = sentence(result("none", ratio=3.1, source=source))
    assert text.endswith(
        f"The residual is 3.1 times the noise floor and coherent with no motion: the noise is larger than {known}."
    )


def test_hum_above_the_noise_floor_is_named_with_its_correction() -> None:
    hum = {("a.csv", "z"): 50.0, ("b.csv", "z"): 50.0}
    text = sentence(result("none", ratio=3.1, hum=hum))
    line = "`sensors: {z: {hum: 50 Hz}}`"
    assert text.endswith(f"z contains mains hum of 50 Hz, which counts in the error; {line} removes it.")
    assert "hum" not in sentence(result("none", hum=hum))


def test_an_effect_too_small_to_count_is_named_with_the_noise() -> None:
    left = Remainder(1.0, 0.01, False, True, ("asymmetric_damper", "rig", None))
    text = sentence(result("none", ratio=3.1, remainder=left))
    assert "resembles asymmetric damper in the rig. That effect gains too little to count. The residual is 3.1" in text


def test_an_effect_with_a_remainder_has_its_share_and_what_is_left() -> None:
    left = Remainder(0.00058, 0.3, True, True, ("quadratic_damper", "rig", None), "rig")
    text = sentence(result("effect", PLAY, ratio=34.0, remainder=left, share=0.9994))
    assert "(99.9 % +/- 0.4 % of the error beyond noise)" in text
    assert text.endswith("The remainder (0.058 % of the error beyond noise) resembles quadratic damper in the rig.")


def discrepancy(
    at: str, wheelset: int | None, *, located: bool, lowers_error: bool = True, or_at: tuple[str, ...] = ()
) -> Any:
    locations = [(place, None, NO_EVIDENCE) for place in (at, *or_at)] if or_at else []
    return SimpleNamespace(
        at=at,
        wheelset=wheelset,
        run_dependence=None,
        is_unexplained_difference=False,
        coupling=None,
        drift=None,
        lowers_error=lowers_error,
        is_located=lambda settings: located,
        locations=lambda settings: locations,
    )


def test_a_variation_beside_an_effect_has_its_share_of_the_remainder() -> None:
    left = Remainder(0.058, 0.3, True, True, ("quadratic_damper", "rig", None), "rig")
    drift = SimpleNamespace(path="vehicle.rig.stiffness", share=0.772)
    rest = discrepancy("rig", None, located=True)
    rest.drift, rest.curve = drift, SimpleNamespace(against="t")
    text = sentence(result("effect", PLAY, ratio=3.0, remainder=left, share=0.94, discrepancy=rest))
    assert text.endswith(
        "Of the remainder (5.8 % of the error beyond noise) a variation of vehicle.rig.stiffness with time explains "
        "77 % on the estimation runs."
    )
    rest.lowers_error = False
    text = sentence(result("effect", PLAY, ratio=3.0, remainder=left, share=0.94, discrepancy=rest))
    assert text.endswith("resembles quadratic damper in the rig.")


def test_a_force_of_displacement_and_velocity_is_no_noise() -> None:
    left = Remainder(1.0, 0.01, False, False, surface=SurfaceShares(0.95, 0.15))
    text = sentence(result("none", ratio=3.1, remainder=left))
    assert "depends on displacement and velocity together" in text and "80 % of it on the validation runs" in text
    assert "noise is larger" not in text


def test_a_partial_verdict_has_the_share_and_the_location_of_the_rest() -> None:
    left = Remainder(0.29, 0.3, True, True, None, "secondary_yaw")
    rest = discrepancy("secondary_yaw", None, located=True)
    text = sentence(result("partial", PLAY, ratio=3.0, remainder=left, share=0.71, discrepancy=rest))
    assert text.startswith("Part of the discrepancy identified: clearance in the lateral primary suspension")
    assert "71 % +/- 0.4 % of the error beyond noise explained" in text
    assert text.endswith(
        "The remainder (29 % of the error beyond noise) is acting at the secondary suspension in yaw "
        "and in no law of the catalogue."
    )


def test_a_rest_at_a_place_is_compared_with_the_effect_that_it_resembles() -> None:
    left = Remainder(0.054, 0.3, True, True, ("quadratic_damper", "rig", None), "rig")
    rest = discrepancy("rig", None, located=True)
    text = sentence(result("effect", FRICTION, ratio=5.0, remainder=left, share=0.946, discrepancy=rest))
    assert text.endswith("is acting at the rig and resembles quadratic damper in the rig most.")


@pytest.mark.parametrize(
    ("vibration", "ratio", "is_stated"), [(4.93, 20.0, True), (None, 20.0, False), (4.93, 1.1, False)]
)
def test_a_rest_about_one_frequency_is_stated_with_that_of_the_rig(
    vibration: float | None, ratio: float, is_stated: bool
) -> None:
    left = Remainder(1.0, 0.3, True, False, vibration=vibration)
    found = result("outside", ratio=ratio, discrepancy=discrepancy("rig", None, located=True), remainder=left)
    values = {"vehicle.rig.mass": 10.0, "vehicle.rig.stiffness": 3553.0}
    found.after.model.value = values.__getitem__
    expected = "What is left is largest about 4.93 Hz; the natural frequency of the rig without added effects is 3 Hz."
    assert sentence(found).endswith(expected) == is_stated


@pytest.mark.parametrize(
    ("form", "delay", "ratio", "is_stated"),
    [("bench", 6e-3, 5.0, True), ("bench", -6e-3, 5.0, False), ("bench", 6e-3, 1.1, False), ("rig", 6e-3, 5.0, False)],
)
def test_a_late_force_of_a_component_is_not_told_from_a_mounting(
    form: str, delay: float, ratio: float, is_stated: bool
) -> None:
    late = PlacedEffect("sensor_delay", "F", None, {"delay": delay})
    found = result("effect", late, ratio=ratio)
    found.nominal.design.form = form  # type: ignore[misc]
    assert ("(or a mounting in series, which these runs do not distinguish)" in sentence(found)) == is_stated


def test_a_discrepancy_is_localised_without_naming_an_effect() -> None:
    assert sentence(result("outside", discrepancy=discrepancy("contact", 2, located=True))) == (
        "Discrepancy that no effect of the catalogue explains, acting at the wheel-rail contact of wheelset 2. "
        "Validation error 0.351 -> 0.054 with the identified force curve; expected from noise alone 0.053."
    )


def test_a_force_curve_that_does_not_lower_the_error_is_no_explanation() -> None:
    text = sentence(result("outside", discrepancy=discrepancy("rig", None, located=True, lowers_error=False)))
    assert text.endswith(
        "Validation error 0.054, which the identified force curve does not lower; expected from noise alone 0.053."
    )


def test_a_location_without_evidence_is_not_named() -> None:
    text = sentence(result("outside", discrepancy=discrepancy("contact", 2, located=False)))
    assert text.startswith("Discrepancy that no effect of the catalogue explains, not located.")
    assert "contact" not in text


def test_locations_that_explain_as_much_are_all_named() -> None:
    text = sentence(
        result("outside", discrepancy=discrepancy("primary_yaw", None, located=False, or_at=("contact", "wheelset")))
    )
    assert text.startswith(
        "Discrepancy that no effect of the catalogue explains, acting at the primary suspension in yaw or at the "
        "wheel-rail contact, which these signals do not distinguish. Validation error"
    )


def test_a_number_that_differs_between_joints_is_named_with_both_errors() -> None:
    differs = result("outside")
    group = GroupDifference(
        "vehicle.elements.damper.lateral_damping", (1, 2), (6e3, -6e3), 0.8, 5e-4, is_heterogeneous=True
    )
    other = replace(group, path="contact.wheels.roll", is_heterogeneous=False)
    differs.freed = FreedGroups((group, other), None, cast("Validation", SimpleNamespace(nrmse=0.048)))  # type: ignore[misc]
    assert sentence(differs) == (
        "Joints or wheelsets differ in vehicle.elements.damper.lateral_damping. Validation error 0.054 with common "
        "numbers, 0.048 with separate ones; expected from noise alone 0.053."
    )


def test_a_calibrated_model_that_diverges_names_the_run() -> None:
    diverges = result("outside")
    diverges.validations = {"after": SimpleNamespace(nrmse=np.nan, diverged=(("run_b.csv", 3.2),))}  # type: ignore[misc, dict-item]
    diverges.freed = FreedGroups()  # type: ignore[misc]
    diverges.noise_floor = SimpleNamespace(nrmse=np.nan)  # type: ignore[misc, assignment]
    assert sentence(diverges) == (
        "The calibrated model diverges on run_b.csv, so that it does not describe the vehicle there. Validation error "
        "undefined; expected from noise alone unknown."
    )


def test_the_remedy_names_the_numbers_to_free() -> None:
    row = {"path": "contact.wheels.conicity", "unit": "1", "members": [1, 2], "differences": [0.02, -0.02]}
    rows = [{**row, "asks": True}, {**row, "path": "contact.wheels.roll", "asks": False}]
    (line,) = group_lines({"groups": rows})
    assert "Write `free: [contact.wheels.conicity]` in the campaign." in line and "roll" not in line
    assert group_lines({"groups": rows[1:]}) == []


def test_a_failed_calibration_comes_last() -> None:
    failed = result("none")
    failed.is_failed_fit = True  # type: ignore[misc]
    assert sentence(failed).endswith("worse on the validation runs than the nominal one, which takes its place.")


@pytest.mark.parametrize(
    ("path", "named"),
    [
        ("effects.0.damping", "damping of the viscous damper in the primary suspension in yaw of both wheelsets"),
        ("contact.spin_creep", "contact.spin_creep"),
    ],
)
def test_a_parameter_that_differs_between_runs_has_its_value_on_every_run(path: str, named: str) -> None:
    effects = (PlacedEffect("viscous_damper", "primary_yaw", None, {"damping": 1e5}),)
    model = SimpleNamespace(effects=effects, design=SimpleNamespace(unit=lambda path: "N*m*s/rad", is_on_track=True))
    found = cast(LoopResult, SimpleNamespace(after=SimpleNamespace(model=model), nominal=fit().model))
    runs = (RunEstimate(0, "a.csv", "adjust", 40.0, 1.5e5, 1e3), RunEstimate(1, "b.csv", "validate", 31.0, 2e5, 2e3))
    text = run_dependence_text(found, RunDependence(path, {path: 1.0}, runs, 5e-4, cast(Validation, None)))
    assert f"run to run, {named} would be 150 kN*m*s/rad on a.csv (40 m/s) and 200 kN*m*s/rad on b.csv" in text
