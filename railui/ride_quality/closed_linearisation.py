"""Statistical linearisation of profiles over the motion that the linearised vehicle has itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from railui.io.problems import file_problem
from railui.track.excitation import Excitation
from railui.vehicle.contact_profiles import GROUP, PARAMETERS_BY_KEY, USE_PATH, ContactProfiles
from railui.vehicle.design import Design
from railui.vehicle.resolve import resolve_model
from railui.vehicle.simulate import simulate_series

TOLERANCE: Final = 1e-3  # relative change of a standard deviation at which the iteration ends
MAX_ITERATIONS: Final = 30
UNDAMPED_ITERATIONS: Final = 8  # afterwards half of each change, against a cycle of two values
LINEARISED_KEYS: Final = ("conicity", "gravitational_stiffness", "contact_angle", "roll")


@dataclass(frozen=True)
class LinearisationStep:
    """One pass: sd over which the contact is linearised and sd of e in the ride [m], parameters, by contact group."""

    sd: Mapping[str, float]
    ridden_sd: Mapping[str, float]
    parameters: Mapping[str, Mapping[str, float]]

    @property
    def change(self) -> float:
        """Largest relative change of a standard deviation."""
        return max(abs(self.ridden_sd[group] / sd - 1.0) for group, sd in self.sd.items())


@dataclass(frozen=True)
class ClosedLinearisation:
    """Result: the passes, the linearised design of the last one, and sd of e in a ride with the table [m].

    `table_sd` is None for a design that does not use the table of its profiles.
    """

    steps: tuple[LinearisationStep, ...]
    design: Design
    has_converged: bool
    table_sd: Mapping[str, float] | None

    def document(self) -> dict[str, Any]:
        """Return the result as data, SI."""
        last = self.steps[-1]
        overrides = {USE_PATH: "linearised"} | {f"{GROUP}.{group}.sd": sd for group, sd in last.sd.items()}
        return {
            "groups": list(last.sd),
            "iterations": [
                {"sd": [*one.sd.values()], "ridden_sd": [*one.ridden_sd.values()]}
                | {key: [each[key] for each in one.parameters.values()] for key in LINEARISED_KEYS}
                for one in self.steps
            ],
            "has_converged": self.has_converged,
            "table_sd": None if self.table_sd is None else [*self.table_sd.values()],
            "linearised_overrides": overrides,
        }


def close_linearisation(design: Design, excitation: Excitation, *, once: bool = False) -> ClosedLinearisation:
    """Linearise the profiles of a design over its own motion on a track, each wheelset for itself.

    Each pass linearises the geometry over the standard deviations of e, simulates the linearised vehicle with its other
    effects, and takes the standard deviations of e for the next pass, until the motion reproduces them.

    Parameters
    ----------
    design : Design
        With profiles from which its contact parameters follow.
    excitation : Excitation
        Track at a speed.
    once : bool
        Linearise once, over the standard deviations of the design.

    Raises
    ------
    FileProblems
        For a design without profiles or with contact parameters of its own, and for a motion beyond the treads.
    ValueError
        If a linearised vehicle leaves the track.

    References
    ----------
    Broersen 1976, 3.4 and 5.5.
    """
    profiles = _profiles_of(design)
    sd = {group: design.value(f"{GROUP}.{group}.sd") for group in profiles.groups}
    steps: list[LinearisationStep] = []
    while True:
        linear = _linearised(design, sd)
        ridden = ridden_deviations(linear, excitation)
        parameters = {g: {key: linear.values[f"contact.{g}.{key}"] for key in LINEARISED_KEYS} for g in sd}
        steps.append(LinearisationStep(sd, ridden, parameters))
        has_converged = steps[-1].change < TOLERANCE
        if once or has_converged or len(steps) == MAX_ITERATIONS:
            table = ridden_deviations(design, excitation) if profiles.has_derived_table else None
            return ClosedLinearisation(tuple(steps), linear, has_converged, table)
        share = 1.0 if len(steps) < UNDAMPED_ITERATIONS else 0.5
        sd = {group: _in_range(old + share * (ridden[group] - old)) for group, old in sd.items()}


def _profiles_of(design: Design) -> ContactProfiles:
    name, path = str(design.source or design.name), GROUP
    if design.profiles is None:
        raise file_problem(name, "the design has no profiles to linearise", "add `contact: {profiles: {...}}`", path)
    if not any(f"contact.{group}.conicity" in design.profiles.derived for group in design.profiles.groups):
        message = "the design gives its conicities itself: nothing follows the motion"
        raise file_problem(name, message, "leave out the contact parameters that the profiles shall give", path)
    return design.profiles


def _linearised(design: Design, sd: Mapping[str, float]) -> Design:
    return design.with_values({USE_PATH: "linearised"} | {f"{GROUP}.{group}.sd": x for group, x in sd.items()})


def ridden_deviations(design: Design, excitation: Excitation) -> dict[str, float]:
    """Return the standard deviation of e [m] of each contact group, the root mean square over its wheelsets.

    Raises ValueError if the vehicle leaves the track.
    """
    model = resolve_model(design)
    count = len(model.wheelset_distances())
    series, diverged_at = simulate_series(model, excitation, [f"e{i + 1}" for i in range(count)], jobs=None)
    if diverged_at is not None:
        where = f"s = {excitation.distance_at(diverged_at):.5g} m"
        raise ValueError(f"the vehicle leaves the track at {where}: add flange_contact, or take a lower speed")
    variances = series.var(axis=1)
    assert design.profiles is not None
    groups = {group: [i - 1 for i in site.wheelsets] for group, site in design.profiles.groups.items()}
    every = list(range(count))
    return {group: float(np.sqrt(variances[members or every].mean())) for group, members in groups.items()}


def _in_range(deviation: float) -> float:
    record = PARAMETERS_BY_KEY["sd"]
    return float(min(max(deviation, record.minimum), record.maximum))
