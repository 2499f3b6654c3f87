"""Checks of wheel-rail contact: Kalker's coefficients, equivalent conicity."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

import numpy as np

from railui.doctor.check import Check

KALKER: Final = "Kalker 1990, table E.3, Poisson's ratio 0.25; typed twice: shows typing errors only"
EN_15302: Final = "EN 15302, nominal results"
# a/b, then C11, C22, C23
COEFFICIENTS: Final = (
    *((0.1, 3.31, 2.52, 0.473), (0.2, 3.37, 2.63, 0.603), (0.3, 3.44, 2.75, 0.715), (0.4, 3.53, 2.88, 0.823)),
    *((0.5, 3.62, 3.01, 0.929), (0.6, 3.72, 3.14, 1.03), (0.7, 3.81, 3.28, 1.14), (0.8, 3.91, 3.41, 1.25)),
    *((0.9, 4.01, 3.54, 1.36), (1.0, 4.12, 3.67, 1.47)),
    *((1 / 0.9, 4.22, 3.81, 1.59), (1 / 0.8, 4.36, 3.99, 1.75), (1 / 0.7, 4.54, 4.21, 1.95)),
    *((1 / 0.6, 4.78, 4.50, 2.23), (1 / 0.5, 5.10, 4.90, 2.62), (1 / 0.4, 5.57, 5.48, 3.24)),
    *((1 / 0.3, 6.34, 6.40, 4.32), (1 / 0.2, 7.78, 8.14, 6.63), (1 / 0.1, 11.7, 12.8, 14.6)),
)  # fmt: skip
AMPLITUDES: Final = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)  # mm
NOMINAL: Final[dict[str, tuple[float | None, ...]]] = {
    "E1": (0.125, 0.155, 0.188, 0.216, 0.254, 0.303),
    "E2": (0.025, 0.025, 0.058, 0.241, 0.283, 0.302),
    "E3": (0.025, 0.025, 0.245, 0.319, 0.306, 0.284),
    "E4": (None, 0.293, 0.489, 0.485, 0.475, 0.447),
}
S1002: Final = {1.435: 0.181, 1.437: 0.148, 1.432: 0.225}  # gauge [m]: tan gamma_e at 3 mm


def kalkers_coefficients() -> Iterator[Check]:
    """Yield all of table E.3 for Poisson's ratio 0.25, the column nearest to steel."""
    from railui.contact.kalker import kalker_coefficients

    for name, column in (("C11", 1), ("C22", 2), ("C23", 3)):
        computed = [float(kalker_coefficients(row[0])[column - 1]) for row in COEFFICIENTS]
        title = f"{name} at a/b 0.1 to 1 and b/a 0.9 to 0.1"
        yield Check(title, [row[column] for row in COEFFICIENTS], computed, KALKER, 1e-6)


def cones() -> Iterator[Check]:
    """Yield the equivalent conicity of cones, which is their own at any amplitude."""
    from railui.contact.conicity import equivalent_conicity

    y = np.linspace(-8e-3, 8e-3, 161)
    for conicity in (0.05, 0.4):
        computed = equivalent_conicity(y, 2 * conicity * y, np.array([1e-3, 3e-3, 6e-3])).tan_gamma.tolist()
        yield Check(f"equivalent conicity of a cone of {conicity:g}", [conicity] * 3, computed, "by definition", 1e-5)


def conicity_of_the_standard(reference: Path) -> Iterator[Check]:
    """Yield the conicity of the delta r tables of the standard, within 0.004 of nominal for 2 to 5 mm."""
    from railui.contact.conicity import equivalent_conicity

    for name, nominal in NOMINAL.items():
        table = np.genfromtxt(reference / "en15302" / f"{name}_delta_r.csv", delimiter=",", skip_header=1) * 1e-3
        curve = equivalent_conicity(table[:, 0], table[:, 1], np.array(AMPLITUDES) * 1e-3)
        computed = [None if np.isnan(value) else value for value in curve.tan_gamma.tolist()]
        yield Check(f"{name}, tan gamma_e at 2 to 5 mm", nominal[1:5], computed[1:5], EN_15302, 4e-3)
        if nominal[0] is None:
            yield Check(
                f"{name}, tan gamma_e at 1 mm", None, computed[0], f"{EN_15302}: no orbit round the centre", 0.0
            )


def tolerance_of_the_standard(reference: Path) -> Iterator[Check]:
    """Yield the conicity of every table of the standard that the directory has, at all amplitudes within its bounds."""
    from railui.contact.conicity import equivalent_conicity

    for file in sorted((reference / "en15302").glob("E*_conicity.csv")):
        name = file.name.partition("_")[0]
        bounds = np.genfromtxt(file, delimiter=",", skip_header=1)
        table = np.genfromtxt(file.with_name(f"{name}_delta_r.csv"), delimiter=",", skip_header=1) * 1e-3
        within = bounds[bounds[:, 1] > 0.0]  # 0: no orbit round the centre
        curve = equivalent_conicity(table[:, 0], table[:, 1], within[:, 0] * 1e-3)
        reached = np.isin(np.round(within[:, 0], 3), np.round(curve.amplitude * 1e3, 3))
        upper, lower = within[reached, 2], within[reached, 3]
        outside = int(np.sum(~((curve.tan_gamma >= lower) & (curve.tan_gamma <= upper))))
        title = f"{name}, amplitudes of {len(upper)} with tan gamma_e outside the tolerance"
        yield Check(title, 0.0, float(outside), EN_15302, 0.0)


def conicity_of_profiles(reference: Path) -> Iterator[Check]:
    """Yield S1002 on UIC60, rigid contact with roll, within 0.02 of two independent computations."""
    from railui.contact.conicity import equivalent_conicity
    from railui.contact.contact_points import find_contacts
    from railui.contact.profile_reader import read_profile
    from railui.contact.wheelset_on_track import WheelRailPair

    wheel = read_profile(reference / "profiles" / "S1002.prw", "wheel")
    rail = read_profile(reference / "profiles" / "UIC60.prr", "rail")
    geometries = [find_contacts(WheelRailPair(wheel, rail, gauge=gauge)) for gauge in S1002]
    computed = [equivalent_conicity(each.displacement, each.delta_r).at(3e-3) for each in geometries]
    title = "S1002 on UIC60, tan gamma_e at 3 mm, gauge 1435, 1437, 1432 mm"
    yield Check(title, list(S1002.values()), computed, "worked out twice, rigid contact with roll", 0.02)


GROUPS: Final[tuple[Callable[[], Iterator[Check]], ...]] = (kalkers_coefficients, cones)
REFERENCE_DATA_CHECKS: Final[dict[str, Callable[[Path], Iterator[Check]]]] = {
    "equivalent conicity, EN 15302 E1 to E4": conicity_of_the_standard,
    "equivalent conicity, tolerance of EN 15302": tolerance_of_the_standard,
    "equivalent conicity of S1002 on UIC60": conicity_of_profiles,
}
