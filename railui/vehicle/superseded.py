"""Numbers of a vehicle that an effect replaces by its own."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from railui.io.problems import Findings, Problem
from railui.vehicle.effects import kernel_catalogue, record_of

if TYPE_CHECKING:
    from railui.vehicle.design import Design


def superseded_paths(design: Design, *, with_defaults: bool = False) -> dict[str, str]:
    """Return the path of the effect's number by that of the vehicle's which it replaces.

    As of a coach_mode with a stiffness and a damping of its own; where it has none, it takes those of the vehicle.

    with_defaults: include numbers that the effect has taken from the vehicle, which do not follow it in a fit.
    """
    replaced = {}
    for i, effect in enumerate(design.effects):
        record = record_of(effect.kind, kernel_catalogue()) or {}
        for term in ("stiffness", "damping"):
            is_own = term in effect.parameters and (with_defaults or term not in effect.defaulted)
            if is_own and term in str(record.get("supersedes")):
                replaced[f"vehicle.{effect.at.replace('_', '.', 1)}_{term}"] = f"effects.{i}.{term}"
    return replaced


def warn_of_superseded(design: Design, paths: Iterable[str], findings: Findings, group: str = "") -> None:
    """Warn of changes of numbers that an effect of the design replaces by its own; group: of the paths in the file."""
    replaced = superseded_paths(design)
    for path in paths:
        if path in replaced:
            effect = design.effects[int(replaced[path].split(".")[1])]
            message = f"has no effect, the {effect.kind} at {effect.at} replaces it by its own"
            findings.warn(f"{group}{path}", message, f"change {replaced[path]}")


def superseded_warnings(design: Design, paths: Iterable[str]) -> tuple[Problem, ...]:
    """Return warnings on overrides that have no effect."""
    findings = Findings("override")
    warn_of_superseded(design, paths, findings)
    return findings.warnings()
