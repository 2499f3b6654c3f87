"""Positions of stops and clearances of a rig on its record, and the sides on which the runs reach them.

The catalogue's laws are symmetrical about the position without force. Where the mean is removed from the comparison, a
preload may move the simulated motion against the recorded one, and with it a stop that acts on one side.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.identification.result import LoopResult
from railui.report.loop.catalogued_effects import catalogued_effects
from railui.report.loop.force_evaluation import ports_at
from railui.report.loop.ride_quality import mean_errors
from railui.report.loop.wording import effect_title, location_phrase, unit_location
from railui.report.numbers import quantity_cells
from railui.vehicle.effects import PlacedEffect, parameter_unit


@dataclass(frozen=True)
class StopPosition:
    """Positions at which a law with a gap begins to act on either side, in the recorded coordinate.

    Attributes
    ----------
    parameter : str
        Key of the gap.
    offset : float
        Mean of the recorded less the simulated displacement.
    lower, upper : float
        Positions on the two sides.
    lower_reached, upper_reached : bool
        Whether the estimation runs reach them, and stay there for more than a small part of the time on the other side.
    unit : str
    sd : float or None
        Standard deviation of the gap, to which the texts round.
    """

    parameter: str
    offset: float
    lower: float
    upper: float
    lower_reached: bool
    upper_reached: bool
    unit: str
    sd: float | None = None

    @property
    def reached(self) -> list[float]:
        """Positions that the estimation runs reach."""
        sides = ((self.lower, self.lower_reached), (self.upper, self.upper_reached))
        return [position for position, is_reached in sides if is_reached]

    def texts(self, positions: list[float]) -> list[str]:
        """Return positions with their unit."""
        return [quantity_cells(position, self.sd, self.unit)[0] for position in positions]


def stop_position(result: LoopResult, effect: PlacedEffect, path: str) -> StopPosition | None:
    """Return the positions of an effect of a rig; None for a law without a gap, and where the model diverges.

    path: that of the effect.
    """
    if effect.at != "rig":
        return None
    gaps = [p for p in core.effect_record(effect.kind)["parameters"] if p["unit"] == "z" and p["role"] == "shape"]
    deflections = _deflections(result, effect) if gaps else None
    if deflections is None:
        return None
    gap = float(effect.parameters[gaps[0]["key"]])  # type: ignore[arg-type]
    beyond = float(np.mean(deflections < -gap)), float(np.mean(deflections > gap))
    least = result.context.settings.notes.min_reached_ratio * max(beyond)
    below, above = (0.0 < share >= least for share in beyond)
    is_prescribed = result.nominal.design.form == "bench"
    offset = 0.0 if is_prescribed else mean_errors(result).get("z", 0.0)
    unit = parameter_unit(gaps[0], unit_location(result, effect.at))
    key, sd = str(gaps[0]["key"]), dict(zip(result.after.free.paths, result.after.sd.tolist(), strict=True))
    return StopPosition(key, offset, offset - gap, offset + gap, below, above, unit, sd.get(f"{path}.{key}"))


def position_records(result: LoopResult, effect: PlacedEffect, path: str) -> list[dict[str, Any]]:
    """Return the positions of an effect as rows of the report; empty for a law without a gap."""
    position = stop_position(result, effect, path)
    if position is None:
        return []
    return [{key: value for key, value in asdict(position).items() if key != "sd"}]


def position_text(position: StopPosition | None) -> str:
    """Return where a law with a gap acts on the record; empty where that is on both sides alike.

    An offset of the record up to the standard deviation of the gap does not count.
    """
    if position is None or not position.reached:
        return ""
    if len(position.reached) == 1:
        return f" (at {position.texts(position.reached)[0]} of the recorded motion, the only side reached)"
    if not abs(position.offset) > (position.sd or 0.0):
        return ""
    return f" (at {' and '.join(position.texts(position.reached))} of the recorded motion)"


def one_sided_notes(result: LoopResult) -> list[str]:
    """Return a note on every stop or clearance that the estimation runs reach on one side only."""
    notes = []
    for group, i, effect in catalogued_effects(result):
        position = stop_position(result, effect, f"{group}.{i}")
        if position is None or len(position.reached) != 1:
            continue
        (reached,) = position.texts(position.reached)
        (other,) = position.texts([position.lower if position.upper_reached else position.upper])
        where = location_phrase(effect.at, effect.wheelset, result.nominal.design.structure)
        notes.append(
            f"{effect_title(effect.kind)} in {where}: the estimation runs reach it at {reached} only, not at {other}; "
            "a stop on one side, or a stiffness that differs by side, fits them as well"
        )
    return notes


def position_texts(result: LoopResult, effect: PlacedEffect, path: str) -> dict[str, str]:
    """Return the text on the positions of an effect, by the key of its gap; path: that of the effect."""
    position = stop_position(result, effect, path)
    return {} if position is None else {position.parameter: position_text(position)}


def _deflections(result: LoopResult, effect: PlacedEffect) -> FloatArray | None:
    """Deflections [n] at an effect over the estimation runs; None where the final model diverges on all of them."""
    model = result.after.model
    names = [f"z.{effect.at}.{w}" for w in ports_at(model, effect.at, effect.wheelset)]
    series = [target.motion_predictor(model).simulate(names) for target in result.after.segments] if names else []
    motions = [s.series[0].ravel() for s in series if s.diverged[0] < 0]
    return np.concatenate(motions) if motions else None
