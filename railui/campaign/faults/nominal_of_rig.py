"""Faults of a whole rig that only the nominal model shows: exchanged columns, a unit of all runs, a reversed input.

The nominal model is inaccurate. Columns are exchanged where its responses fit after the exchange and are far off
before. A unit is a thousand or a million. A sign is wrong where no model about the nominal one has the phases of the
responses, through a resonance, and one has the opposite ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from railui.arrays import ComplexArray
from railui.campaign.corrections.correction import Correction, Corrections, yaml_line
from railui.campaign.dataset import Dataset
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.rig_responses import (
    are_driven,
    driving_column,
    explained_share,
    longest_records,
    measured_response,
    median_decades,
    nominal_response,
    phase_agreement,
    ratio_of_responses,
    ratio_to_nominal,
    response_frequencies,
    window_seconds,
)
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from railui.io.problems import FileProblems
from railui.io.table import read_header
from railui.io.units import UnitError, parse_unit
from railui.vehicle.design import Design

STIFFNESS, DAMPING = "vehicle.rig.stiffness", "vehicle.rig.damping"
STIFFNESS_FACTORS = np.geomspace(0.25, 4.0, 9)  # about the nominal value
DAMPING_FACTORS = np.geomspace(0.2, 5.0, 5)
MIN_DAMPING = 0.02  # of the critical one, of a nominal model without any
UNIT_DECADES = 3  # a unit of all runs is a thousand times another, or a multiple
MIN_PHASE_RANGE = 0.5 * np.pi  # of a response through a resonance

Records = Mapping[str, Segment]


def faults_against_nominal(dataset: Dataset, runs: Mapping[str, Sequence[Segment]]) -> list[Fault]:
    """Find the fault that makes all responses of a rig fit the nominal model, where they are far off it."""
    design, settings, records = dataset.campaign.design, dataset.campaign.settings.faults, longest_records(runs)
    if design.effects or not are_driven(records):
        return []
    channels = [c for c in next(iter(records.values())).channels if all(c in s.columns for s in records.values())]
    fits = _Fits(design, channels, settings, window_seconds(records))
    if not channels:
        return []
    return _exchanged(dataset, records, fits) or _unit(records, fits) or _reversed(records, fits)


class _Fits:
    """Comparison of records with the nominal model."""

    def __init__(self, design: Design, channels: Sequence[str], settings: FaultSettings, seconds: float) -> None:
        self.design, self.channels, self.settings, self.seconds = design, channels, settings, seconds

    def of(self, records: Records) -> list[tuple[float, float]]:
        """Decades off and agreement of the phase of each channel in each record, as far as they are known.

        Empty where a channel is no response.
        """
        if not self.are_responses(records):
            return []
        ratios = [
            ratio_to_nominal(self.design, s, c, self.seconds) for s, c in product(records.values(), self.channels)
        ]
        found = [(median_decades(r), phase_agreement(r)) for r in ratios]
        return [(decades, agreement) for decades, agreement in found if np.isfinite(agreement)]

    def are_responses(self, records: Records) -> bool:
        """True where every channel follows the driving column."""
        shares = (explained_share(s, c, self.seconds) for s, c in product(records.values(), self.channels))
        return all(x > self.settings.min_explained_share for x in shares)

    def is_good(self, found: Sequence[tuple[float, float]]) -> bool:
        """True where all responses have size and phase of the nominal model."""
        size, phase = self.settings.max_nominal_decades, self.settings.nominal_agreement
        return bool(found) and all(abs(decades) < size and agreement > phase for decades, agreement in found)


def _distance(found: Sequence[tuple[float, float]]) -> float:
    """Distance from the nominal model of the response that is furthest off in size and phase."""
    return max((abs(decades) + 1.0 - agreement for decades, agreement in found), default=float("nan"))


def _exchanged(dataset: Dataset, records: Records, fits: _Fits) -> list[Fault]:
    """Find the two columns that must be exchanged for all responses to fit."""
    before = _distance(fits.of(records))
    columns = [driving_column(next(iter(records.values()))), *fits.channels]
    fitting = []
    for a, b in combinations(columns, 2):
        for factor in dict.fromkeys((_header_ratio(dataset, a, b), 1.0)):
            swapped = {name: _with_exchange(s, a, b, factor) for name, s in records.items()}
            found = fits.of(swapped)
            if fits.is_good(found) and before - _distance(found) > fits.settings.min_exchange_gain:
                fitting.append((a, b, factor))
                break
    return [_exchange_fault(*fitting[0], tuple(records))] if len(fitting) == 1 else []


def _with_exchange(segment: Segment, a: str, b: str, factor: float) -> Segment:
    """Return a segment with two columns exchanged; factor: unit of the header of b over that of a."""
    columns = {**segment.columns, a: segment.columns[b] / factor, b: segment.columns[a] * factor}
    return replace(segment, columns=columns, tables={})


def _exchange_fault(a: str, b: str, factor: float, files: tuple[str, ...]) -> Fault:
    changes = [Correction(a, swap_with=b, gain=factor)]
    changes += [Correction(b, gain=1.0 / factor)] if factor != 1.0 else []
    text = f"{a} and {b} are exchanged: the nominal model responds as recorded once each has the place of the other"
    remedy = f"exchange the names {a} and {b} in the header"
    corrections = Corrections(tuple(changes))
    return Fault("exchanged", (a, b), None, None, "1", files, text, True, corrections, remedy=remedy)


def _header_ratio(dataset: Dataset, a: str, b: str) -> float:
    """Return the unit of column b in the headers of a bench over that of a, by which reading has converted them."""
    if dataset.campaign.design.rig_input != "motion":
        return 1.0  # the columns of other rigs are in the units of their headers
    factors = {_factors(run.file, a, b) for run in dataset.runs}
    return factors.pop() if len(factors) == 1 else 1.0


def _factors(file: object, a: str, b: str) -> float:
    try:
        header = read_header(file)  # type: ignore[arg-type]
        units = dict(zip(header.names, header.units, strict=True))
        return float(f"{parse_unit(units[b]).factor / parse_unit(units[a]).factor:.9g}")
    except (FileProblems, KeyError, OSError, TypeError, UnitError):
        return 1.0


def _unit(records: Records, fits: _Fits) -> list[Fault]:
    """Find a unit of the driving column that is a thousand or a million times another."""
    found = fits.of(records)
    rounded = {UNIT_DECADES * round(decades / UNIT_DECADES) for decades, _ in found if np.isfinite(decades)}
    if len(rounded) != 1 or not all(agreement > fits.settings.nominal_agreement for _, agreement in found):
        return []
    decades = rounded.pop()
    if decades == 0 or any(abs(x - decades) > fits.settings.max_unit_deviation for x, _ in found):
        return []
    column, size = driving_column(next(iter(records.values()))), 10.0 ** abs(decades)
    of_input = Corrections((Correction(column, gain=10.0**-decades),))
    of_responses = Corrections(tuple(Correction(c, gain=10.0**decades) for c in fits.channels))
    has_input = len(fits.channels) > 1
    corrections, others = (of_input, ()) if has_input else (of_responses, (yaml_line(of_input),))
    blamed = column if has_input else fits.channels[0]
    is_large = (decades < 0) == has_input
    text = (
        f"{blamed} is {size:g} times too {'large' if is_large else 'small'}: the responses to {column} are "
        f"{size:g} times too {'small' if decades < 0 else 'large'} for the nominal model, with its phases"
    )
    remedy = "correct the values of the design if these are wrong"
    gain = corrections.channels[0].gain
    return [Fault("unit", (blamed,), gain, None, "1", tuple(records), text, True, corrections, others, remedy)]


def _reversed(records: Records, fits: _Fits) -> list[Fault]:
    """Find an input that the motion opposes, for any stiffness and damping about the nominal ones."""
    if fits.design.rig_input == "motion" or not fits.are_responses(records):
        return []  # the force of a component has its own test
    measured = _measured(records, fits)
    agreements = [(values, _agreements(measured, fits, values)) for values in _models(fits.design)]
    opposite, values = max(((-max(found), values) for values, found in agreements), key=lambda item: item[0])
    alike = max(min(found) for _, found in agreements)
    is_opposite = opposite > fits.settings.reversed_agreement and alike < 0.0
    if not (is_opposite and _have_resonance(measured, fits, values)):
        return []
    of_input = Corrections((Correction("u", gain=-1.0),))
    of_responses = Corrections(tuple(Correction(c, gain=-1.0) for c in fits.channels))
    names = ("all of " if len(fits.channels) > 1 else "") + " and ".join(fits.channels)
    text = (
        f"the input u or {names} has the wrong sign: the motion opposes the input for any stiffness and damping about "
        "the nominal ones"
    )
    files, other = tuple(records), (yaml_line(of_responses),)
    return [Fault("sign", ("u",), -1.0, None, "1", files, text, True, of_input, other)]


def _models(design: Design) -> Iterator[Mapping[str, float]]:
    """Yield the values of models about the nominal one."""
    critical = 2.0 * np.sqrt(abs(design.values[STIFFNESS] * design.values["vehicle.rig.mass"]))
    damping = max(design.values[DAMPING], MIN_DAMPING * critical)
    for k, c in product(STIFFNESS_FACTORS, DAMPING_FACTORS):
        yield {**design.values, STIFFNESS: float(k) * design.values[STIFFNESS], DAMPING: float(c) * damping}


def _measured(records: Records, fits: _Fits) -> list[tuple[str, ComplexArray]]:
    """Responses of all channels in all records."""
    pairs = product(records.values(), fits.channels)
    return [(c, measured_response(s, c, fits.seconds)) for s, c in pairs]


def _agreements(measured: Sequence[tuple[str, ComplexArray]], fits: _Fits, values: Mapping[str, float]) -> list[float]:
    """Agreement of the phase of each response with a model; zero where it is not known."""
    found = []
    for channel, response in measured:
        f = response_frequencies(response, fits.seconds)
        nominal = nominal_response(fits.design, channel, f, values)
        found.append(phase_agreement(ratio_of_responses(response, nominal)))
    return [x if np.isfinite(x) else 0.0 for x in found]


def _have_resonance(measured: Sequence[tuple[str, ComplexArray]], fits: _Fits, values: Mapping[str, float]) -> bool:
    """True where the phase of a model turns by a right angle or more over the frequencies of every response."""
    for channel, response in measured:
        f = response_frequencies(response, fits.seconds)[np.isfinite(response)]
        phase = np.unwrap(np.angle(nominal_response(fits.design, channel, f, values)))
        if not (len(f) and np.ptp(phase) > MIN_PHASE_RANGE):
            return False
    return True
