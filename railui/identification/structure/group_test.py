"""Score test of the differences between the joints or wheelsets that share an estimated number.

One number of an element stands for all its joints, one of a contact group for all its wheelsets. The sensitivities to
the number of each member, after projecting out what the estimated parameters absorb, are correlated with the residual:
a Lagrange-multiplier test of equal members, without a fit in which they differ.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.problem import truncate
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.family_wise_test import family_wise_p, highest_scores_of_noise
from railui.identification.structure.projection import Projector
from railui.vehicle.division import divide_design, divisible_numbers


@dataclass(frozen=True)
class GroupDifference:
    """Test of the differences between the members of a group.

    Attributes
    ----------
    path : str
        The number that they share.
    members : tuple of int
        Numbers of the joints or wheelsets.
    differences : tuple of float
        Estimated deviation of each member from their mean, SI.
    partial_correlation : float
        Multiple correlation of the differences with the residual.
    p_value : float
        Family-wise, over all groups.
    is_heterogeneous : bool
        Whether the members differ significantly, by an amount that matters.
    """

    path: str
    members: tuple[int, ...]
    differences: tuple[float, ...]
    partial_correlation: float
    p_value: float
    is_heterogeneous: bool


@dataclass(frozen=True)
class Contrast(Candidate):
    """A difference between members, tested like an effect of either sign."""

    @property
    def is_one_sided(self) -> bool:
        """False: a member may have more than the others, or less."""
        return False


def compare_group_members(context: Context, fit: Fit) -> tuple[GroupDifference, ...]:
    """Test every shared number of a fit; a heterogeneous group is divided before the others are tested again.

    Returns
    -------
    tuple of GroupDifference
        The heterogeneous ones first. Empty for a vehicle without shared numbers.
    """
    structure = fit.model.design.structure
    if structure is None or context.is_out_of_time:
        return ()
    estimated = set(fit.free.paths) - set(structure.divided_numbers)
    shared = {path: numbers for path, numbers in divisible_numbers(structure).items() if path in estimated}
    if not shared:
        return ()
    test = _GroupTest(context, fit, shared)
    heterogeneous: list[GroupDifference] = []
    while len(heterogeneous) < len(shared):
        found = sorted(test.run([g.path for g in heterogeneous]), key=lambda g: -g.partial_correlation)
        best = next((g for g in found if g.is_heterogeneous), None)
        if best is None:
            return (*heterogeneous, *found)
        heterogeneous.append(best)
    return tuple(heterogeneous)


def misfit_beyond_noise(context: Context, rss: float, samples: int) -> float:
    """Return the part of a misfit that makes a model inadequate; 0 for an adequate one."""
    return max(rss - context.settings.selection.adequate_ratio**2 * samples, 0.0)


class _GroupTest:
    """Inner products of the residual and the sensitivities to the number of each member."""

    def __init__(self, context: Context, fit: Fit, shared: Mapping[str, tuple[int, ...]]) -> None:
        self.context, self.fit, self.shared = context, fit, shared
        self.settings = context.settings.score_test
        structure = fit.model.design.structure
        assert structure is not None
        design = divide_design(fit.model.design, list(shared))
        assert design.structure is not None
        members = [design.structure.paths_of(path) for path in fit.free.paths]
        self.owner = np.repeat(np.arange(len(members)), [len(paths) for paths in members])
        free = fit.free.take(self.owner, [path for paths in members for path in paths])
        segments = truncate(context, fit.segments, self.settings.score_duration)
        newton = GaussNewton(context, replace(fit.model, design=design), free, segments, block=fit.block)
        normal = newton.linearise(fit.x[self.owner])
        self.products = normal.gram.sum(axis=1)  # [block, 1 + member, 1 + member]
        self.variance, self.samples = normal.variance, normal.samples

    def run(self, freed: Collection[str]) -> list[GroupDifference]:
        """Test every group but those freed, whose members are estimated one by one."""
        base, owners = self._base(freed)
        free, x = self.fit.free.take(owners), self.fit.x[owners]
        projector = Projector(base @ self.products @ base.T, free, x, self.variance)
        lanes = [(path, row) for path in self.shared if path not in freed for row in self._contrasts(path)]
        rows = np.array([row for _, row in lanes])
        cross, norms = rows @ self.products @ base.T, np.einsum("lp,bpq,lq->bl", rows, self.products, rows)
        scores = projector.project(cross, norms, self.settings.min_remaining_share_linear)
        results = [
            scores.score_result(Contrast(path, "", None), 0, lane)
            for lane, (path, _) in enumerate(lanes)
            if scores.is_distinguishable[lane]
        ]
        highest = highest_scores_of_noise(results, self.settings, self.context.seed) if results else np.zeros(0)

        def p_of(path: str) -> float:
            tested = [s for s in results if s.candidate.kind == path]
            return family_wise_p(highest, tested) if tested else 1.0

        return [self._difference(path, projector, base, p_of(path)) for path in self.shared if path not in freed]

    def _base(self, freed: Collection[str]) -> tuple[FloatArray, NDArray[np.intp]]:
        """Residual and parameters as sums [1 + p, 1 + member] of the members, with their indices [p] in the fit."""
        paths = self.fit.free.paths
        groups = [[i] for i, j in enumerate(self.owner) if paths[j] in freed]
        groups += [list(np.flatnonzero(self.owner == j)) for j, path in enumerate(paths) if path not in freed]
        base = np.zeros((1 + len(groups), 1 + len(self.owner)))
        base[0, 0] = 1.0
        for row, group in enumerate(groups, 1):
            base[row, 1 + np.array(group)] = 1.0
        return base, self.owner[[group[0] for group in groups]]

    def _members(self, path: str) -> FloatArray:
        """Rows [member, 1 + all members] of one member of a group each."""
        columns = 1 + np.flatnonzero(self.owner == self.fit.free.paths.index(path))
        return np.eye(1 + len(self.owner))[columns]

    def _contrasts(self, path: str) -> Iterator[FloatArray]:
        """Each member against the others; of four and more, front against rear and every second one as well."""
        rows = self._members(path)
        yield from rows if len(rows) > 2 else rows[:1]
        if len(rows) > 2 and len(rows) % 2 == 0:
            yield rows[: len(rows) // 2].sum(axis=0)
            yield rows[::2].sum(axis=0)

    def _difference(self, path: str, projector: Projector, base: FloatArray, p: float) -> GroupDifference:
        j = self.fit.free.paths.index(path)
        rows, total = self._members(path), self.products.sum(axis=0)
        gram, score = projector.gram(rows @ total @ base.T, rows @ total @ rows.T)
        # members that the data do not separate differ by as much as a prior allows
        size = abs(self.fit.x[j]) or self.fit.free.size[j]
        usual = self.context.settings.calibration.element_prior_share * size
        estimate = np.linalg.solve(gram + np.eye(len(rows)) * self.variance / usual**2, score)
        explained = max(float(score @ estimate), 0.0)
        differences = estimate - estimate.mean()
        rho2 = explained / max(projector.rss, 1e-300)
        is_large = float(np.max(np.abs(differences))) >= self.settings.min_group_difference * size
        beyond_noise = misfit_beyond_noise(self.context, projector.rss, self.samples)
        is_heterogeneous = (
            p <= self.settings.significance_level
            and rho2 >= self.settings.structured_rho2
            and explained >= self.settings.min_group_share * beyond_noise
            and is_large
        )
        return GroupDifference(
            path, self.shared[path], tuple(differences.tolist()), float(np.sqrt(min(rho2, 1.0))), p, is_heterogeneous
        )
