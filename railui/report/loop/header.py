"""Header of the loop page: vehicle, campaign, date, runs, channels, verdict and what to inspect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from railui.campaign.comparison import compared_channels
from railui.campaign.segment import Segment
from railui.identification.result import LoopResult
from railui.report.loop.inspection import inspection_lines
from railui.report.loop.sentence import format_share
from railui.report.loop.wording import ROLE_LABELS, VERDICT_LABELS
from railui.report.numbers import format_number

Report = Mapping[str, Any]

ORIGINS = {
    "simulated": "simulated runs: nothing was measured",
    "measured": "measured runs",
    None: "runs of unstated origin (key data of the campaign: measured or simulated)",
}


def header_rows(result: LoopResult, report: Report) -> list[tuple[str, str]]:
    """Return the rows of the header, name and text."""
    dataset = result.dataset
    return [
        ("vehicle", result.nominal.design.name),
        ("campaign", report["campaign"]),
        ("date of analysis", report["date"]),
        ("data", ORIGINS[report["data"]]),
        *_runs(dataset.segments),
        ("channels", _channels(dataset.segments)),
        ("verdict", _verdict(report)),
        ("inspect", _numbered(inspection_lines(report, result.nominal.design.structure))),
    ]


def _numbered(lines: Sequence[str]) -> str:
    """Return lines as one text, numbered where there are several."""
    return lines[0] if len(lines) == 1 else "; ".join(f"({i}) {line}" for i, line in enumerate(lines, 1))


def _runs(segments: Sequence[Segment]) -> list[tuple[str, str]]:
    """Return duration, and on a track speed and length, of the runs of every role."""
    rows = []
    for role in dict.fromkeys(s.role for s in segments):
        of_role = [s for s in segments if s.role == role]
        files = len({s.run_index for s in of_role})
        seconds = sum(s.samples * s.dt for s in of_role)
        text = f"{files} run{'s' if files > 1 else ''}, {format_number(seconds)} s"
        if not of_role[0].is_rig:
            text += f", {_distance(of_role)} at {_speeds(of_role)}"
        rows.append((f"{ROLE_LABELS[role]} runs", text))
    return rows


def _distance(segments: Sequence[Segment]) -> str:
    metres = sum(float(s.columns["s"][-1] - s.columns["s"][0]) for s in segments)
    return f"{metres / 1e3:.2f} km" if metres >= 1e3 else f"{metres:.0f} m"


def _speeds(segments: Sequence[Segment]) -> str:
    slowest, fastest = min(s.speeds[0] for s in segments), max(s.speeds[1] for s in segments)
    if fastest - slowest < 0.05 * fastest:
        mean = sum(s.mean_speed for s in segments) / len(segments)
        return f"{mean:.1f} m/s ({3.6 * mean:.0f} km/h)"
    return f"{slowest:.1f} to {fastest:.1f} m/s ({3.6 * slowest:.0f} to {3.6 * fastest:.0f} km/h)"


def _channels(segments: Sequence[Segment]) -> str:
    names = list(dict.fromkeys(c for s in segments for c in compared_channels(s)))
    return f"{len(names)}: {', '.join(names)}"


def _verdict(report: Report) -> str:
    """Return the verdict with its confidence: share explained, error over noise, independent test."""
    words = [VERDICT_LABELS[report["verdict"]]]
    share = report["explained"]["value"]
    if share is not None and report["effects"]:
        words.append(f"{format_share(share)} of the error beyond noise explained")
    if report["unexplained"] is not None:
        words.append(f"error {report['unexplained']:.2f} times that of noise")
    test = report["test"]
    if test["nrmse_after"] is not None and test["floor"]:
        words.append(f"{test['nrmse_after'] / test['floor']:.2f} times on the independent test")
    return "; ".join(words)
