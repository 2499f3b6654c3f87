"""Texts of a fleet: its state in a sentence, and the numbers of an alarm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from railui.report.numbers import DASH, format_number, format_with_sd


def fleet_sentence(document: Mapping[str, Any]) -> str:
    """Return the state of a fleet in one sentence."""
    vehicles, alarms = document["vehicles"], document["alarms"]
    changed = len({row["vehicle"] for row in alarms})
    sections = sum(bool(row["alarms"]) for row in document["sections"])
    track = f"; {sections} sections of track have changed" if sections else ""
    if not changed:
        return f"No change detected on {len(vehicles)} vehicles{track}."
    return f"{changed} of {len(vehicles)} vehicles have changed{track}."


def alarm_texts(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return the numbers of an alarm as texts, and the alarm itself as `row`."""
    onset, limit = row["onset"], row["limit"]
    return {
        "row": row,
        "change": _change_with_sd(row, "change"),
        "total": _change_with_sd(row, "total_change"),
        "rate": format_with_sd(row["rate_per_month"], row["rate_per_month_sd"]),
        "onset": DASH if onset is None else f"{onset['day']} ({onset['low']} to {onset['high']})",
        "limit": DASH if limit is None else _limit(limit),
        "explained": f"{100 * row['explained']:.0f} %",
    }


def _change_with_sd(row: Mapping[str, Any], key: str) -> str:
    """Return a change with its standard deviation and unit, of a parameter also in per cent of the nominal value."""
    change, relative = format_with_sd(row.get(key), row.get(f"{key}_sd")), row.get(f"relative_{key}")
    percent = "" if relative is None else f" ({100 * relative:+.1f} %)"
    return f"{change} {row['unit'] if row['unit'] != '1' else ''}{percent}"


def change_text(row: Mapping[str, Any], key: str = "change") -> str:
    """Return `change` or `total_change` of an alarm in few characters: in per cent for a parameter.

    >>> change_text({"change": -1e5, "relative_change": -0.1}), change_text({"total_change": 1e-4}, "total_change")
    ('-10.0 %', '+0.0001')
    """
    relative, change = row.get(f"relative_{key}"), row.get(key)
    if relative is not None:
        return f"{100 * relative:+.1f} %"
    return DASH if change is None else f"{change:+.3g}"


def limit_day(limit: Mapping[str, Any] | None) -> str:
    """Return the day on which a limit is reached, as text."""
    if limit is None:
        return DASH
    return "exceeded before the onset" if limit.get("exceeded_before") else limit["day"] or "not reached"


def _limit(limit: Mapping[str, Any]) -> str:
    what = limit["criterion"] or limit["parameter"]
    if limit["day"] is None:
        reason = limit_day(limit) if limit.get("exceeded_before") else "not reached at this rate"
        return f"{what} {format_number(limit['limit'])}: {reason}"
    high = limit["high"] or "open"
    return f"{what} {format_number(limit['limit'])}: {limit['day']} ({limit['low']} to {high})"
