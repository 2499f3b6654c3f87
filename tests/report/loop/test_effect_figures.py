"""Figures of effects and of discrepancies outside the catalogue."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railui import core
from railui.identification.result import LoopResult
from railui.identification.unmodelled.discrepancy import Discrepancy, DiscrepancyCurve
from railui.identification.unmodelled.location_evidence import LocationEvidence
from railui.report.loop.data import loop_report
from railui.report.loop.effect_figures import _discrepancy_figure, compute_effect_forces, effect_figures
from railui.report.loop.figures import most_informative_window
from railui.report.loop.force_evaluation import EvaluationWindow
from railui.report.loop.force_pictures import EffectFigure
from railui.report.loop.page import render_page
from railui.report.loop.wording import effect_title
from railui.vehicle.effects import PlacedEffect, default_at


def drawn(result: LoopResult, report: dict[str, Any], of_window: LoopResult) -> list[EffectFigure]:
    window = most_informative_window(of_window)
    return effect_figures(result, report, window, compute_effect_forces(result, window))


def test_an_identified_force_curve_is_drawn_with_error_bars(loop_result: LoopResult) -> None:
    motion, force = np.linspace(-2e-3, 2e-3, 5), -np.array([-900.0, -100.0, 0.0, 100.0, 900.0])
    curve = {"motion": tuple(map(float, motion)), "force": tuple(map(float, force))}
    placed = PlacedEffect("measured_force", "primary_lateral", 2, curve, "z")
    fit = replace(loop_result.before, model=loop_result.before.model.with_effect(placed))
    identified = DiscrepancyCurve("z", motion, force, np.full(5, 20.0), "m", "N")
    validation = loop_result.validations["after"]
    evidence = LocationEvidence(0.9, 0.02)
    discrepancy = Discrepancy("primary_lateral", 2, identified, 0.9, fit, validation, evidence=evidence)
    result = replace(loop_result, after=fit, discrepancy=discrepancy, verdict="outside")
    (figure,) = drawn(result, loop_report(result), loop_result)
    assert figure.title == "identified force curve: lateral primary suspension, wheelset 2"
    assert [picture.name for picture in figure.pictures] == ["outside-whole", "outside"]
    html = render_page(result, loop_report(result))
    assert "outside the catalogue" in html and "two standard deviations" in html
    assert "<h2>Discrepancy" in html and "Identified effect" not in html


# a curve is drawn from its points, above
@pytest.mark.parametrize(
    "record", [r for r in core.effect_catalogue() if r["kind"] not in core.CURVE_KINDS], ids=lambda r: r["kind"]
)
def test_every_effect_of_the_catalogue_is_drawn(
    loop_result: LoopResult, report: dict[str, Any], record: dict[str, Any]
) -> None:
    model = loop_result.before.model
    at = next((p for p in record["at"] if p != "rig"), record["at"][0])
    needed = [p for p in record["parameters"] if not p["optional"]]
    values = {p["key"]: default_at(p, at, model.design.values) or min(1e3, p["maximum"] or 1e3) for p in needed}
    placed = model.with_effect(PlacedEffect(record["kind"], at, None, values))
    result = replace(loop_result, after=replace(loop_result.before, model=placed))
    (figure,) = drawn(result, report, loop_result)
    assert effect_title(record["kind"]) in figure.title
    assert figure.pictures or "constant" in figure.note


def test_a_discrepancy_that_cannot_be_simulated_has_a_note(
    loop_result: LoopResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> EvaluationWindow:
        raise ValueError("diverged at 3 s")

    monkeypatch.setattr(EvaluationWindow, "of", fail)
    figure = _discrepancy_figure(loop_result, loop_result.before.model, {}, most_informative_window(loop_result))
    assert figure.note == "Not drawn: diverged at 3 s." and not figure.pictures
