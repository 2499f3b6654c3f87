"""Table of a trial: one row per campaign, and totals with confidence limits."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from tests.blind.assessment import ADEQUATE_RATIO, TrialRow

HEAD = (
    f"{'no':>5s} {'planted':54s} {'noise':10s} {'sensors':16s} {'verdict':9s} {'named':52s} name class "
    "decl. before after floor oracle  a/f   cpu"
)
NORMAL_QUANTILE_95 = 1.6449  # half-width of a 90 % interval in standard deviations
HELD_BY_PRIORS = ("contact_angle", "spin_creep")
BOOTSTRAP_DRAWS = 4000
MATERIAL_RATIO = 1.10  # of the error by an effect that is missed, from which it counts
MARKS = ("<!-- trial -->", "<!-- end of trial -->")
TABLE_HEAD = ["| outcome | count | % | 95 % limits |", "| --- | ---: | ---: | ---: |"]


def format_row(x: TrialRow) -> str:
    """Format a row of the table."""
    mark = {True: "yes", False: "NO", None: "-"}
    name, kind = mark[x.right_name], mark[x.right_class]
    if not x.is_relevant and x.verdict == "none" and x.sort not in ("nothing", "limit", "floor"):
        name = kind = "weak"
    return (
        f"{x.number:5d} {x.planted:54.54s} {x.nuisance:10s} {x.sensors:16.16s} {x.verdict:9s} "
        f"{(x.named or x.problem or '-'):52.52s} "
        f"{name:4s} {kind:5s} {x.declared:5.3f} {x.before:5.3f} {x.after:5.3f} {x.floor:5.3f} {x.oracle:6.3f} "
        f"{x.after / x.floor:5.2f} {x.cpu:4.0f}" + (f"  without: {x.without}" if x.without else "")
    )


def clopper_pearson(right: int, of: int) -> tuple[float, float]:
    """Compute the 95 % confidence limits of a share (Clopper and Pearson)."""
    low = float(beta.ppf(0.025, right, of - right + 1)) if right else 0.0
    high = float(beta.ppf(0.975, right + 1, of - right)) if right < of else 1.0
    return low, high


def format_total(title: str, results: Sequence[bool]) -> str:
    """Format a line of the totals."""
    right, of = sum(results), len(results)
    if not of:
        return f"| {title} | 0 of 0 |  |  |"
    return _line(title, right, of, clopper_pearson(right, of))


def _line(title: str, right: int, of: int, limits: tuple[float, float]) -> str:
    low, high = limits
    return f"| {title} | {right} of {of} | {100 * right / of:.0f} | {100 * low:.0f} to {100 * high:.0f} |"


def coverage(title: str, rows: Sequence[TrialRow], counts: Callable[[str], bool] = lambda path: True) -> str:
    """Format the share of 90 % intervals with the true value, of the parameters whose path counts.

    The limits are those of a bootstrap over the seeds: the parameters of one campaign share its noise, and campaigns
    of one seed with different effects share vehicle, tracks and noise. Where all or none contain it, a bootstrap has no
    scatter, and the limits are those of Clopper and Pearson.
    """
    by_seed: dict[int, list[bool]] = defaultdict(list)
    for row in rows:
        by_seed[row.number] += [abs(z) <= NORMAL_QUANTILE_95 for path, z in row.z.items() if counts(path)]
    table = np.array([(sum(inside), len(inside)) for inside in by_seed.values() if inside])
    if not len(table):
        return f"| {title} | 0 of 0 |  |  |"
    right, of = map(int, table.sum(axis=0))
    return _line(title, right, of, bootstrap_limits(table))


def bootstrap_limits(counts: NDArray[np.int64]) -> tuple[float, float]:
    """Compute the 95 % confidence limits of a share from counts [group, 2] of what is right, and of all in the group.

    By a bootstrap over the groups; those of Clopper and Pearson where all or none are right.
    """
    right, of = map(int, counts.sum(axis=0))
    if right in (0, of):
        return clopper_pearson(right, of)
    draws = np.random.default_rng(5).integers(len(counts), size=(BOOTSTRAP_DRAWS, len(counts)))
    sums = counts[draws].sum(axis=1)
    low, high = np.quantile(sums[:, 0] / sums[:, 1], (0.025, 0.975))
    return float(low), float(high)


def is_of_effect(path: str) -> bool:
    """True for the path of a parameter of an added effect."""
    return path.startswith(("effects.", "sensors."))


def coverage_lines(rows: Sequence[TrialRow]) -> list[str]:
    """Coverage of the intervals: all, by class of parameter, by noise and by sensors."""

    def held(path: str) -> bool:
        return any(name in path for name in HELD_BY_PRIORS)

    title = "90 % intervals with the true value"
    lines = [
        coverage(f"{title}: all parameters", rows),
        coverage(f"{title}: vehicle, determined by the data", rows, lambda p: not held(p) and not is_of_effect(p)),
        coverage(f"{title}: vehicle, held by a prior", rows, held),
        coverage(f"{title}: added effects", rows, is_of_effect),
    ]
    for name in sorted({x.nuisance for x in rows if x.scores}):
        lines.append(coverage(f"{title}: noise {name or 'as stated'}", [x for x in rows if x.nuisance == name]))
    for name in sorted({x.sensors for x in rows if x.scores}):
        lines.append(coverage(f"{title}: sensors {name}", [x for x in rows if x.sensors == name]))
    return lines


def totals(rows: Sequence[TrialRow]) -> list[str]:
    """Format the totals of a trial with their confidence limits, as a table."""
    single = [x for x in rows if x.sort == "catalogue" and x.is_relevant]
    several = [x for x in rows if x.sort in ("two", "three") and x.is_relevant]
    nothing = [x for x in rows if x.sort in ("nothing", "limit")]
    outside = [x for x in rows if x.sort == "outside" and (x.is_relevant or x.verdict == "exception")]
    planted = [x for x in rows if x.sort in ("catalogue", "two", "three", "outside")]
    weak = [x for x in planted if not x.is_relevant and x.verdict != "exception"]
    right = [x for x in [*single, *several] if x.right_class]
    as_stated = [x for x in right if not x.nuisance]
    limits = [x for x in rows if x.sort == "floor"]
    lines = [
        *TABLE_HEAD,
        format_total("one effect planted: right name, class and location", [bool(x.right_name) for x in single]),
        format_total("one effect planted: right class and location", [bool(x.right_class) for x in single]),
    ]
    for sort in ("two", "three"):
        of_sort = [x for x in several if x.sort == sort]
        lines.append(format_total(f"{sort} effects planted: all names", [bool(x.right_name) for x in of_sort]))
    lines += [
        format_total("two or three effects planted: all names, or error at most 1.10 times that of the oracle",
                     [bool(x.right_name) or x.after <= MATERIAL_RATIO * x.oracle for x in several]),
        format_total("no effect planted: false alarm", [x.verdict not in ("none", "exception") for x in nothing]),
        *(
            format_total(
                f"no effect planted, noise {name or 'as stated'}: false alarm",
                [x.verdict not in ("none", "exception") for x in nothing if x.nuisance == name],
            )
            for name in sorted({x.nuisance for x in nothing})
        ),
        *(
            format_total(f"outside the library: verdict `{verdict}`", [x.verdict == verdict for x in outside])
            for verdict in ("outside", "partial", "none", "data")
        ),
        *location_lines(outside),
        format_total(
            "outside the library: an effect of the library named instead",
            [x.verdict == "effect" and x.after <= ADEQUATE_RATIO * x.floor for x in outside],
        ),
        format_total("effects planted: verdict `partial`", [x.verdict == "partial" for x in [*single, *several]]),
        format_total("all campaigns: verdict `data`", [x.verdict == "data" for x in rows]),
        format_total("error at most 1.05 times that of the oracle, class right", [x.after <= 1.05 * x.oracle
                                                                                    for x in right]),
        format_total("error at most 1.10 times the noise floor, noise as stated", [x.after <= ADEQUATE_RATIO * x.floor
                                                                                     for x in as_stated]),
        format_total("true effect excluded: no other effect named", [bool(x.admits) for x in rows if x.without]),
        format_total("detected at the minimum detectable effect (nominal power 90 %)", [bool(x.right_class)
                                                                                          for x in limits]),
        format_total("too weak to count: verdict `none`", [x.verdict == "none" for x in weak]),
        *coverage_lines(rows),
        format_total("data fault diagnosed in sound data", [bool(x.data_fault) for x in rows]),
        format_total("exceptions", [x.verdict == "exception" for x in rows]),
        format_total("diverged on a validation run", [not np.isfinite(x.after) and x.verdict != "exception"
                                                        for x in rows]),
    ]  # fmt: skip
    return [*lines, *times(rows)]


def location_lines(outside: Sequence[TrialRow]) -> list[str]:
    """Format how many discrepancies outside the library were located, at one location or at one of several."""
    recognised = [x for x in outside if x.verdict == "outside"]
    several = [x for x in recognised if " or " in x.named]
    one = [x for x in recognised if x.right_place is not None and x not in several]
    return [
        format_total("verdict `outside`: one location named", [x in one for x in recognised]),
        format_total("verdict `outside`, one location named: it is right", [bool(x.right_place) for x in one]),
        format_total("verdict `outside`, several locations named: right among them", [bool(x.right_place)
                                                                                       for x in several]),
    ]  # fmt: skip


def times(rows: Sequence[TrialRow]) -> list[str]:
    """Format the times of the loops."""
    measured = [x for x in rows if np.isfinite(x.cpu)]
    if not measured:
        return []
    wall, cpu = ([getattr(x, name) for x in measured] for name in ("seconds", "cpu"))
    return [
        "",
        f"One loop takes {np.median(cpu):.0f} s of processor time in the median and {max(cpu):.0f} s at worst "
        f"({np.median(wall):.0f} s and {max(wall):.0f} s by the clock; processor time over clock "
        f"{sum(cpu) / sum(wall):.2f}).",
    ]


def write_section(path: Path, command: str, lines: Sequence[str], marks: tuple[str, str] = MARKS) -> None:
    """Replace the section of the trial in a document, between its marks.

    Raises
    ------
    ValueError
        Where the document does not have both marks.
    """
    text, (begin, end) = path.read_text(), marks
    if begin not in text or end not in text:
        raise ValueError(f"{path} lacks the lines {begin} and {end}: write both where the table belongs")
    head, tail = text[: text.index(begin)], text[text.index(end) :]
    path.write_text("\n".join([f"{head}{begin}", f"`{command}`:", "", *lines, "", tail]))
