"""Texts of the fleet panel: its state in a few lines, and the evidence for an alarm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from rich.text import Text

from railui.report.fleet.alarm_texts import alarm_texts, fleet_sentence

NAME_COLUMNS: Final = 20


def summary_text(document: Mapping[str, Any] | None, activity: str) -> Text:
    """Return sentence, counts of runs, changed sections of track, and the activity."""
    if document is None:
        return Text(activity, "dim")
    runs = document["runs"]
    text = Text(fleet_sentence(document), "bold", no_wrap=True, overflow="ellipsis")
    left_out = sum(runs["left_out"].values())
    counts = f"{runs['all']} runs, {runs['computed']} of them new at the last update"
    text.append(f"\n{counts}{f', {left_out} left out' if left_out else ''}", "not bold")
    changed = [f"{row['section']} on {row['alarms'][-1]['raised']}" for row in document["sections"] if row["alarms"]]
    if changed:
        text.append(f"\ntrack changed: {', '.join(changed)}", "not bold yellow")
    text.append(f"\n{activity}", "not bold dim")
    return text


def evidence_text(alarm: Mapping[str, Any]) -> Text:
    """Return everything on which an alarm rests."""
    texts = alarm_texts(alarm)
    others = ", ".join(alarm["not_separated_from"]) or "none"
    total = [("in total", texts["total"])] if alarm.get("total_change", alarm["change"]) != alarm["change"] else []
    rows = (
        ("change", texts["change"]),
        *total,
        ("growth per month", f"{texts['rate']} {alarm['unit'] if alarm['unit'] != '1' else ''}"),
        ("onset, 90 %", texts["onset"]),
        ("limit", texts["limit"]),
        ("explained", texts["explained"]),
        ("not separated from", others),
        ("raised by", f"{alarm['raised_by']}: sum {alarm['sum']:+.1f}, threshold {alarm['threshold']:.1f}"),
        ("runs", f"{len(alarm['runs'])}, the latest {alarm['runs'][-1]}" if alarm["runs"] else "none"),
        ("loop", alarm["loop"] or "not run; S runs one"),
    )
    text = Text(f"{alarm['vehicle']}, {alarm['raised']}: {alarm['verdict']}, {alarm['quantity']}\n", "bold")
    for name, value in rows:
        text.append(f"{name:{NAME_COLUMNS}}", "not bold dim")
        text.append(f"{value}\n", "not bold")
    text.rstrip()
    return text
