"""Rival explanations of a residual: a drift, a coupling, or members of a group that differ, instead of an effect."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.structure.couplings import find_couplings
from railui.identification.structure.drift import find_drifts
from railui.identification.structure.freed_groups import FreedGroups, free_groups
from railui.memo import IdentityCache

REMEMBERED_FITS = 16  # more than the models of a selection


class Rival(NamedTuple):
    """An explanation outside the library, and the share of the misfit that it explains."""

    text: str
    share: float


class RivalExplanations:
    """Explanations with which the effects of the library compete for the residual of a fit."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self.settings = context.settings.selection
        self._outside = IdentityCache[list[Rival]](REMEMBERED_FITS)
        self._freed = IdentityCache[FreedGroups](REMEMBERED_FITS)

    def outside_library(self, fit: Fit, share: float = 0.0) -> list[Rival]:
        """Find the best drift and the best coupling, once for a fit; none where they cannot explain clearly more.

        share: of the misfit, that an effect explains.
        """
        if self.settings.rival_ratio * share > 1.0:
            return []

        def find() -> list[Rival]:
            # not on a rig, whose amplitude and frequency may change with time: a law explains that
            drifts = find_drifts(self.context, fit)[:1] if fit.model.design.is_on_track else []
            couplings = find_couplings(self.context, fit)[:1]
            return [
                *(Rival(f"{d.path} varying along the track", d.share) for d in drifts),
                *(Rival(f"a coupling of {c.text}", c.share) for c in couplings),
            ]

        return self._outside.get("outside", find, owner=fit)

    def explain_more(self, rivals: Sequence[Rival], share: float) -> bool:
        """True where one of these explains clearly more than an effect that explains a share of the misfit."""
        for rival in rivals:
            if rival.share >= max(self.settings.rival_ratio * share, self.settings.rival_share):
                self.context.progress.message(f"  {rival.text} explains more: {rival.share:.2f}, not {share:.2f}")
                return True
        return False

    def freed_groups(self, fit: Fit) -> FreedGroups:
        """Test the differences within groups against the residual of a fit, once."""
        return self._freed.get("freed", lambda: free_groups(self.context, fit), owner=fit)

    def members_explain_as_much(self, fit: Fit, rss: float, parameters: int) -> bool:
        """True where different numbers of joints or wheelsets explain as much as effects that leave a misfit.

        They do with as many parameters or fewer at nearly the same misfit, or with more at a misfit that is clearly
        lower: a worn damper of one joint is no new law.
        """
        freed = self.freed_groups(fit).fit
        if freed is None:
            return False
        ratio = self.settings.simpler_misfit_ratio if len(freed.x) <= parameters else 1.0 / self.settings.rival_ratio
        if freed.normal.rss > ratio * rss:
            return False
        shares = [1.0 - x / fit.normal.rss for x in (freed.normal.rss, rss)]
        self.context.progress.message(
            f"  separate numbers explain {shares[0]:.2f} of the misfit, effects {shares[1]:.2f}"
        )
        return True
