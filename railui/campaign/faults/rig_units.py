"""Header units of a rig that do not go together: a force in N and a motion in mm, with the mass in kg."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from railui.campaign.corrections.correction import Correction, Corrections
from railui.campaign.dataset import Dataset
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.rig_responses import are_driven, longest_records, ratio_to_nominal, window_seconds
from railui.campaign.segment import Segment
from railui.io.units import UnitError, parse_unit, parse_unit_like

# dimension of the input and of the motion: translation, rotation
INPUT_UNITS = {
    "force": (("N", "m"), ("N*m", "rad")),
    "base_displacement": (("m", "m"), ("rad", "rad")),
    "base_acceleration": (("m/s^2", "m"), ("rad/s^2", "rad")),
}
RATES = {"z": "", "vz": "/s", "az": "/s^2"}


def fault_of_header_units(dataset: Dataset, runs: Mapping[str, Sequence[Segment]]) -> list[Fault]:
    """Find an input whose header unit does not go with that of the motion, where the data show that it matters.

    The numbers of a rig are in the units of its runs, and a gain may convert them. The units are wrong where the
    nominal model fits the measured response much better in SI than in these numbers.
    """
    campaign, records = dataset.campaign, longest_records(runs)
    if campaign.design.rig_input not in INPUT_UNITS or campaign.design.effects or not are_driven(records):
        return []
    channel = next((c for c in RATES if all(c in s.columns for s in records.values())), None)
    factors = {_unit_factor(dataset, i, channel) for i in range(len(dataset.runs))} if channel else {None}
    factor = factors.pop()
    if factors or factor is None or channel is None:
        return []
    decades, limit = float(np.log10(factor)), campaign.settings.faults.min_header_decades
    seconds = window_seconds(records)
    for segment in records.values():
        ratio = np.abs(ratio_to_nominal(campaign.design, segment, channel, seconds))
        off = float(np.nanmedian(np.log10(ratio))) if np.isfinite(ratio).any() else 0.0
        if abs(decades) < limit or abs(off - decades) > limit * abs(decades):
            return []
    return [_fault(dataset, channel, factor, tuple(records))]


def _fault(dataset: Dataset, channel: str, factor: float, files: tuple[str, ...]) -> Fault:
    units = dataset.runs[0].units
    text = f"u in {units['u']} and {channel} in {units[channel]} are not of one system of units"
    remedy = f"write the columns in SI units, or `gain: {factor:g}` in the design"
    corrections = Corrections((Correction("u", gain=1.0 / factor),))
    return Fault("unit", ("u",), 1.0 / factor, None, "1", files, text, True, corrections, remedy=remedy)


def _unit_factor(dataset: Dataset, index: int, channel: str) -> float | None:
    """Return the unit of the input over that of the motion, in SI, as corrected; None if they are not known."""
    run, name = dataset.runs[index], dataset.campaign.runs[index].name
    gains = {c: 1.0 for c in (channel, "u")}
    for correction in dataset.campaign.corrections.of_run(name)[0]:
        if correction.channel in gains:
            gains[correction.channel] *= correction.gain
    for drive, motion in INPUT_UNITS[dataset.campaign.design.rig_input]:
        given, wanted = (
            _factor(run.units.get(c, ""), unit) for c, unit in (("u", drive), (channel, motion + RATES[channel]))
        )
        if given is not None and wanted is not None:
            return abs(float(f"{given * gains['u'] / (wanted * gains[channel]):.6g}"))
    return None


def _factor(label: str, unit: str) -> float | None:
    """Return the factor from a label to a unit; None where they do not fit."""
    try:
        given, wanted = parse_unit_like(label, unit), parse_unit(unit)
    except UnitError:
        return None
    return given.factor / wanted.factor if label and given.dimension == wanted.dimension else None
