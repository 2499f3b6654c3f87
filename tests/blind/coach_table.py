"""Table of the trial of coaches: totals with confidence limits, then every campaign."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.blind.assessment import ADEQUATE_RATIO, TrialRow
from tests.blind.table import (
    MATERIAL_RATIO,
    TABLE_HEAD,
    coverage,
    format_total,
    is_of_effect,
    location_lines,
    times,
)

MARKS = ("<!-- coaches -->", "<!-- end of coaches -->")
ON_FLOOR = "frames and floor"


def has_right_joints(row: TrialRow) -> bool:
    """True if the effects found are those planted, each at the same joint or group of joints."""
    return sorted(row.named.split(" + ")) == sorted(row.planted.split(" + "))


def names_planted_only(row: TrialRow) -> bool:
    """True if every effect that was found is planted, at the same joint or group of joints."""
    return set(row.named.split(" + ")) <= set(row.planted.split(" + "))


def is_immaterial(row: TrialRow) -> bool:
    """True if what was not found costs a tenth of the error at most, and what was found is planted."""
    return names_planted_only(row) and row.after <= MATERIAL_RATIO * row.oracle


def names_wrongly(row: TrialRow) -> bool:
    """True if effects explain the data as well as noise allows, and one of them is neither planted nor alike."""
    is_clean = row.verdict == "effect" and row.after <= ADEQUATE_RATIO * row.floor
    return is_clean and not row.right_class and not names_planted_only(row)


def coach_totals(rows: Sequence[TrialRow]) -> list[str]:
    """Format the totals of the trial as a table, and the table of all campaigns."""
    relevant = [x for x in rows if x.is_relevant or x.verdict == "exception"]
    single = [x for x in relevant if x.sort == "catalogue"]
    floor = [x for x in single if x.sensors == ON_FLOOR]
    rest = [x for x in single if x.sensors != ON_FLOOR]
    two = [x for x in relevant if x.sort == "two"]
    outside = [x for x in relevant if x.sort == "outside"]
    nothing = [x for x in rows if x.sort == "nothing"]
    weak = [x for x in rows if x.sort != "nothing" and x not in relevant]
    planted = [*single, *two]
    right = [x for x in planted if x.right_class]

    def share(title: str, sort: Sequence[TrialRow], name: str) -> str:
        return format_total(title, [bool(getattr(x, name)) for x in sort])

    few = "one effect planted, accelerometers on frames and floor only"
    lines = [
        *TABLE_HEAD,
        share("one or two effects planted: all names and joint groups right", planted, "right_name"),
        format_total("one or two effects planted: all names and joint groups right, or error at most 1.10 times that of"
                     " the oracle and no wrong name",
                     [x.right_name or is_immaterial(x) for x in planted]),
        share("one effect planted: right name and joint group", rest, "right_name"),
        share("one effect planted: right class and joint group", rest, "right_class"),
        share(f"{few}: right name and joint group", floor, "right_name"),
        share(f"{few}: right class and joint group", floor, "right_class"),
        share("two effects planted: both names and joint groups right", two, "right_name"),
        format_total("of the right names: the same single joint, or all of the group",
                     [has_right_joints(x) for x in planted if x.right_name]),
        format_total("no effect planted: false alarm", [x.verdict not in ("none", "exception") for x in nothing]),
        *(
            format_total(f"outside the library: verdict `{verdict}`", [x.verdict == verdict for x in outside])
            for verdict in ("outside", "partial", "none", "effect", "data")
        ),
        *location_lines(outside),
        format_total("all campaigns: at the noise floor by an effect that is neither planted nor alike",
                     [names_wrongly(x) for x in rows]),
        format_total("effects planted: verdict `partial`", [x.verdict == "partial" for x in planted]),
        format_total("error at most 1.05 times that of the oracle, class right", [x.after <= 1.05 * x.oracle
                                                                                    for x in right]),
        format_total("too weak to count: verdict `none`", [x.verdict == "none" for x in weak]),
        coverage("90 % intervals with the true value: parameters of the vehicle", rows,
                 lambda path: not is_of_effect(path)),
        coverage("90 % intervals with the true value: sizes of effects", rows, is_of_effect),
        format_total("data fault diagnosed in sound data", [bool(x.data_fault) for x in rows]),
        format_total("exceptions", [x.verdict == "exception" for x in rows]),
        format_total("diverged on a validation run", [not np.isfinite(x.after) and x.verdict != "exception"
                                                        for x in rows]),
    ]  # fmt: skip
    return [*lines, *times(rows), "", *campaign_lines(rows)]


def campaign_lines(rows: Sequence[TrialRow]) -> list[str]:
    """Format one line per campaign."""
    lines = [
        "| no | planted | sensors | noise | found | verdict | name | before | after | floor | oracle |",
        "| ---: | --- | --- | --- | --- | --- | --- | ---: | ---: | ---: | ---: |",
    ]
    for x in sorted(rows, key=lambda x: x.number):
        oracle = f"{x.oracle:.3f}" if x.oracle == x.oracle else ""
        lines.append(
            f"| {x.number} | {x.planted} | {x.sensors} | {x.nuisance or 'as stated'} | {x.named or x.problem or '-'} "
            f"| `{x.verdict}` | {outcome(x)} | {x.before:.3f} | {x.after:.3f} | {x.floor:.3f} | {oracle} |"
        )
    return lines


def outcome(row: TrialRow) -> str:
    """Judge a row in a word."""
    is_planted = row.sort in ("catalogue", "two")
    if row.sort == "nothing":
        return "right" if row.verdict == "none" else "false alarm"
    if not row.is_relevant and row.verdict == "none":
        return "weak"
    if not is_planted:
        place = {True: ", location right", False: ", location wrong", None: ""}[row.right_place]
        return ("right" + place) if row.right_class else "wrong"
    return "right" if row.right_name else "class right" if row.right_class else "wrong"
