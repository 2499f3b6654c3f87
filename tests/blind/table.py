"""The table of a trial: a line per campaign, and totals with binomial limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import beta

from tests.blind.answers import ADEQUATE, Line

HEAD = (
    f"{'no':>5s} {'planted':54s} {'nuisance':10s} {'verdict':9s} {'named':52s} name class "
    "decl. before after floor oracle  a/f   cpu"
)


def printed(x: Line) -> str:
    """A line of the table."""
    mark = {True: "yes", False: "NO", None: "-"}
    name, kind = mark[x.right_name], mark[x.right_class]
    if not x.material and x.verdict == "none" and x.sort != "nothing":
        name = kind = "weak"
    return (
        f"{x.number:5d} {x.planted:54.54s} {x.nuisance:10s} {x.verdict:9s} {(x.named or x.problem or '-'):52.52s} "
        f"{name:4s} {kind:5s} {x.declared:5.3f} {x.before:5.3f} {x.after:5.3f} {x.floor:5.3f} {x.oracle:6.3f} "
        f"{x.after / x.floor:5.2f} {x.cpu:4.0f}" + (f"  without: {x.without}" if x.without else "")
    )


def limits(right: int, of: int) -> tuple[float, float]:
    """95 % limits of a share, Clopper and Pearson."""
    low = float(beta.ppf(0.025, right, of - right + 1)) if right else 0.0
    high = float(beta.ppf(0.975, right + 1, of - right)) if right < of else 1.0
    return low, high


def counted(title: str, answers: Sequence[bool]) -> str:
    """A line of the totals."""
    right, of = sum(answers), len(answers)
    if not of:
        return f"{title:58s} none of them"
    low, high = limits(right, of)
    return f"{title:58s} {right:3d} of {of:3d}   {100 * right / of:5.1f} %   ({100 * low:.0f} to {100 * high:.0f} %)"


def totals(lines: Sequence[Line]) -> list[str]:
    """The totals of a trial with binomial limits."""
    one = [x for x in lines if x.sort == "catalogue" and x.material]
    two = [x for x in lines if x.sort == "two" and x.material]
    nothing = [x for x in lines if x.sort == "nothing"]
    strangers = [x for x in lines if x.sort == "outside" and (x.material or x.verdict == "exception")]
    found_outside = [x for x in strangers if x.right_class]
    right = [x for x in [*one, *two] if x.right_class]
    # coloured noise and unmeasured forces are not in the floor: they leave up to 1.3 of it with the right effect
    clean = [x for x in [*one, *two] if not x.nuisance]
    weak = [x for x in lines if x.sort in ("catalogue", "two", "outside") and not x.material and x.after == x.after]
    out = [
        counted("right name, one effect", [bool(x.right_name) for x in one]),
        counted("right class, one effect", [bool(x.right_class) for x in one]),
        counted("right place, one effect", [bool(x.right_place) for x in one]),
        counted("both names, two effects", [bool(x.right_name) for x in two]),
        counted("both classes, two effects", [bool(x.right_class) for x in two]),
        counted("false alarms, nothing planted", [x.verdict in ("effect", "outside") for x in nothing]),
        counted("outside the catalogue: verdict outside", [bool(x.right_class) for x in strangers]),
        counted("outside the catalogue: its place, of these", [bool(x.right_place) for x in found_outside]),
        counted(
            "outside the catalogue: a clean effect instead",
            [x.verdict == "effect" and x.after <= ADEQUATE * x.floor for x in strangers],
        ),
        counted("after at most 1.05 of the oracle's, class right", [x.after <= 1.05 * x.oracle for x in right]),
        counted("after at most 1.10 floor, noise as declared", [x.after <= ADEQUATE * x.floor for x in clean]),
        counted("answer taken away: no clean effect named instead", [bool(x.admits) for x in lines if x.without]),
    ]
    inside, of = sum(x.covered for x in lines), sum(x.intervals for x in lines)
    if of:
        out.append(
            f"{'true numbers inside their 90 % intervals':58s} {inside:3d} of {of:3d}   {100 * inside / of:5.1f} %"
        )
    for factor in (0.5, 1.0, 2.0):
        planted = [x for x in lines if x.sort == "floor" and x.planted.endswith(f"floor x {factor:g}")]
        out.append(
            counted(f"found at {factor:g} times the stated floor (class)", [bool(x.right_class) for x in planted])
        )
    out += [
        counted("exceptions", [x.verdict == "exception" for x in lines]),
        counted("diverged on a validating run", [not np.isfinite(x.after) and x.verdict != "exception" for x in lines]),
        f"{len(weak)} planted too weakly to gain a tenth even with the true structure; "
        f"verdict none in {sum(x.verdict == 'none' for x in weak)}",
    ]
    busy = [x.cpu for x in lines if np.isfinite(x.cpu)]
    if busy:
        out.append(f"processor seconds per loop: median {np.median(busy):.0f}, longest {max(busy):.0f}")
    return out
