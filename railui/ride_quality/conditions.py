"""Conditions of a ride that limit its evaluation: duration, and the limit of guidance."""

from __future__ import annotations

from typing import Final

from railui.ride_quality.comfort import carbody_effect, fixed_transfer_note
from railui.ride_quality.statistics import BLOCK_DURATION, is_guided_by_force
from railui.track.excitation import Excitation
from railui.vehicle.model import Model

SHORT_DURATION: Final = 20.0  # s, eight periods of the lower band limit of W_d, 0.4 Hz


def duration_findings(excitation: Excitation) -> list[tuple[str, str]]:
    """Return the best class of a ride that is shorter than one block of 5 s, with the reason."""
    duration = len(excitation.track) * excitation.dt
    if duration >= BLOCK_DURATION * (1.0 - 1e-9):
        return []
    return [("satisfactory", f"a ride of {duration:.3g} s only, shorter than {BLOCK_DURATION:g} s")]


def duration_notes(excitation: Excitation) -> list[str]:
    """Return a note on a ride too short for reliable statistics."""
    duration = len(excitation.track) * excitation.dt
    if duration >= SHORT_DURATION:
        return []
    return [f"a ride of {duration:.3g} s: its statistics are those of this place, take {SHORT_DURATION:g} s or more"]


def comfort_notes(model: Model) -> list[str]:
    """Return notes on what the comfort of a model leaves out."""
    notes = [] if (note := fixed_transfer_note(model.design)) is None else [note]
    if carbody_effect(model) is not None and sum(e.at == "secondary_lateral" for e in model.design.effects) > 1:
        notes.append("comfort: what other effects at secondary_lateral do to the coach itself is left out")
    return notes


def guidance_notes(model: Model, limit: float) -> list[str]:
    """Return a note on a limit of guidance that is not the flange clearance of the design."""
    if is_guided_by_force(model):
        return [f"guidance: flange_* count the sum of guiding forces against {limit:.5g} N, not flange contact"]
    if model.design.gauge_widens_clearance:
        return ["clearance: widened by half the gauge, of which flange_margin takes mean and spread"]
    return []
