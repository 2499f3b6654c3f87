"""Fit with a separate number for each member of a group whose members differ significantly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.noise_floor import NoiseFloor
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.validation import Validation, is_significant_gain, validate
from railui.identification.prediction import SimulationError
from railui.identification.structure.group_test import (
    GroupDifference,
    compare_group_members,
    misfit_beyond_noise,
)
from railui.vehicle.division import divide_design
from railui.vehicle.model import Model

TOLERANCE = 1e-5


@dataclass(frozen=True, eq=False)
class FreedGroups:
    """Test of all groups against the residual of a fit, and the fit with the members of the heterogeneous ones freed.

    Attributes
    ----------
    groups : tuple of GroupDifference
    fit, validation
        With these members freed, on the runs that select effects; None where no group is heterogeneous or the fit
        diverges.
    """

    groups: tuple[GroupDifference, ...] = ()
    fit: Fit | None = None
    validation: Validation | None = None


def free_groups(context: Context, fit: Fit) -> FreedGroups:
    """Test the differences within all groups, and estimate each member of the heterogeneous ones.

    A group counts as heterogeneous only where its members explain what makes the model inadequate, and do not raise
    the error on other runs: a missing law of one joint differs from the law of the others, too, but no linear member
    explains it all.
    """
    groups: tuple[GroupDifference, ...] = ()
    try:
        groups = () if fit.slips else compare_group_members(context, fit)
        paths = [group.path for group in groups if group.is_heterogeneous]
        if not paths:
            return FreedGroups(groups)
        freed = _freed_fit(context, fit, paths)
    except SimulationError as error:  # the vehicle diverges at a point of the fit
        context.progress.message(f"  members of groups not freed: {error}")
        return _homogeneous(groups)
    unexplained = misfit_beyond_noise(context, fit.normal.rss, fit.normal.samples)
    if fit.normal.rss - freed.normal.rss < context.settings.verdict.min_explained_share * unexplained:
        return _homogeneous(groups)
    validation, common = (validate(context, m, context.dataset.selection) for m in (freed.model, fit.model))
    if not validation.nrmse < common.nrmse:
        return _homogeneous(groups)
    context.progress.message(f"  {', '.join(paths)} freed: NRMSE {validation.nrmse:.4f}")
    return FreedGroups(groups, freed, validation)


def freed_members_lower_error(
    context: Context, freed: FreedGroups, validation: Validation, floor: NoiseFloor | None = None
) -> bool:
    """True where freed members lower the validation error of the common numbers; with a floor, nearly to it."""
    if freed.validation is None or not is_significant_gain(context, validation, freed.validation):
        return False
    return floor is None or freed.validation.nrmse <= context.settings.selection.adequate_ratio * floor.nrmse


def _homogeneous(groups: Sequence[GroupDifference]) -> FreedGroups:
    return FreedGroups(tuple(replace(group, is_heterogeneous=False) for group in groups))


def _freed_fit(context: Context, fit: Fit, paths: Sequence[str]) -> Fit:
    model, nominal = (_divided(m, paths) for m in (fit.model, context.nominal))
    structure = model.design.structure
    assert structure is not None
    members = [each for path in fit.free.paths if "@" not in path for each in structure.paths_of(path)]
    return fit_output_error(
        replace(context.in_background(context.jobs), nominal=nominal),
        model,
        members,
        segments=fit.segments,
        tolerance=TOLERANCE,
    )


def _divided(model: Model, paths: Sequence[str]) -> Model:
    return replace(model, design=divide_design(model.design, paths))
