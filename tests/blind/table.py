"""Table of a trial: one row per campaign, and totals with binomial confidence limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import beta

from tests.blind.assessment import ADEQUATE_RATIO, TrialRow

HEAD = (
    f"{'no':>5s} {'planted':54s} {'nuisance':10s} {'verdict':9s} {'named':52s} name class "
    "decl. before after floor oracle  a/f   cpu"
)


def format_row(x: TrialRow) -> str:
    """Format a row of the table."""
    mark = {True: "yes", False: "NO", None: "-"}
    name, kind = mark[x.right_name], mark[x.right_class]
    if not x.is_relevant and x.verdict == "none" and x.sort != "nothing":
        name = kind = "weak"
    return (
        f"{x.number:5d} {x.planted:54.54s} {x.nuisance:10s} {x.verdict:9s} {(x.named or x.problem or '-'):52.52s} "
        f"{name:4s} {kind:5s} {x.declared:5.3f} {x.before:5.3f} {x.after:5.3f} {x.floor:5.3f} {x.oracle:6.3f} "
        f"{x.after / x.floor:5.2f} {x.cpu:4.0f}" + (f"  without: {x.without}" if x.without else "")
    )


def clopper_pearson(right: int, of: int) -> tuple[float, float]:
    """Compute the 95 % confidence limits of a share (Clopper and Pearson)."""
    low = float(beta.ppf(0.025, right, of - right + 1)) if right else 0.0
    high = float(beta.ppf(0.975, right + 1, of - right)) if right < of else 1.0
    return low, high


def format_total(title: str, results: Sequence[bool]) -> str:
    """Format a row of the totals."""
    right, of = sum(results), len(results)
    if not of:
        return f"{title:58s} none of them"
    low, high = clopper_pearson(right, of)
    return f"{title:58s} {right:3d} of {of:3d}   {100 * right / of:5.1f} %   ({100 * low:.0f} to {100 * high:.0f} %)"


def totals(rows: Sequence[TrialRow]) -> list[str]:
    """Format the totals of a trial with their confidence limits."""
    single = [x for x in rows if x.sort == "catalogue" and x.is_relevant]
    double = [x for x in rows if x.sort == "two" and x.is_relevant]
    nothing = [x for x in rows if x.sort == "nothing"]
    not_in_library = [x for x in rows if x.sort == "outside" and (x.is_relevant or x.verdict == "exception")]
    located = [x for x in not_in_library if x.right_class]
    right = [x for x in [*single, *double] if x.right_class]
    # the noise floor omits coloured noise and unmeasured forces: with the right effect they leave up to 1.3 of it
    clean = [x for x in [*single, *double] if not x.nuisance]
    weak = [x for x in rows if x.sort in ("catalogue", "two", "outside") and not x.is_relevant and x.after == x.after]
    out = [
        format_total("right name, one effect", [bool(x.right_name) for x in single]),
        format_total("right class, one effect", [bool(x.right_class) for x in single]),
        format_total("right place, one effect", [bool(x.right_place) for x in single]),
        format_total("both names, two effects", [bool(x.right_name) for x in double]),
        format_total("both classes, two effects", [bool(x.right_class) for x in double]),
        format_total("false alarms, nothing planted", [x.verdict in ("effect", "outside") for x in nothing]),
        format_total("outside the catalogue: verdict outside", [bool(x.right_class) for x in not_in_library]),
        format_total("outside the catalogue: its place, of these", [bool(x.right_place) for x in located]),
        format_total(
            "outside the catalogue: a clean effect instead",
            [x.verdict == "effect" and x.after <= ADEQUATE_RATIO * x.floor for x in not_in_library],
        ),
        format_total("after at most 1.05 of the oracle's, class right", [x.after <= 1.05 * x.oracle for x in right]),
        format_total(
            "after at most 1.10 floor, noise as declared", [x.after <= ADEQUATE_RATIO * x.floor for x in clean]
        ),
        format_total("answer taken away: no clean effect named instead", [bool(x.admits) for x in rows if x.without]),
    ]
    inside, of = sum(x.covered for x in rows), sum(x.intervals for x in rows)
    if of:
        out.append(
            f"{'true numbers inside their 90 % intervals':58s} {inside:3d} of {of:3d}   {100 * inside / of:5.1f} %"
        )
    for factor in (0.5, 1.0, 2.0):
        planted = [x for x in rows if x.sort == "floor" and x.planted.endswith(f"floor x {factor:g}")]
        out.append(
            format_total(f"found at {factor:g} times the stated floor (class)", [bool(x.right_class) for x in planted])
        )
    out += [
        format_total("exceptions", [x.verdict == "exception" for x in rows]),
        format_total(
            "diverged on a validating run", [not np.isfinite(x.after) and x.verdict != "exception" for x in rows]
        ),
        f"{len(weak)} planted too weakly to gain a tenth even with the true structure; "
        f"verdict none in {sum(x.verdict == 'none' for x in weak)}",
    ]
    cpu_seconds = [x.cpu for x in rows if np.isfinite(x.cpu)]
    if cpu_seconds:
        out.append(f"processor seconds per loop: median {np.median(cpu_seconds):.0f}, longest {max(cpu_seconds):.0f}")
    return out
