"""The loop report as one page: report.html, which opens anywhere without a network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from railui import core
from railui.identification.loop import LoopResult
from railui.io.atomic import write_text
from railui.report.figures.drawing import scale
from railui.report.loop import figures, laws
from railui.report.loop.figures import place
from railui.report.loop.phases import phase_of
from railui.report.numbers import DASH, number, signed, with_sd
from railui.report.rendered import rendered
from railui.runs.columns import columns_of
from railui.vehicle.parameters import PARAMETERS

Report = Mapping[str, Any]
Row = dict[str, Any]

TOP = 12  # candidates shown
MAIN = 4  # channels shown; the others unfold
WHICH = ("declared", "before", "after", "floor")
MEANING = {
    "declared": "the vehicle as declared",
    "before": "adjusted, no effect added",
    "after": "with what was found, adjusted again",
    "floor": "what noise alone would leave",
}
VERDICTS = {
    "none": "nothing missing",
    "effect": "effect found",
    "outside": "outside the catalogue",
}
FLAGS = {
    None: ("determined", "good"),
    "moved": ("determined, moved", "good"),
    "correlated": ("only in combination with others", "fair"),
    "unseen": ("not seen by these sensors, held", "poor"),
    "bound": ("at its bound", "poor"),
}
RIDING = {
    "sd_e1": ("sd of e1, leading wheelset from the rails", "m"),
    "sd_e2": ("sd of e2, trailing wheelset from the rails", "m"),
    "flange_fraction": ("share of time with flange contact", "1"),
    "weighted_acceleration": ("weighted acceleration at the comfort point (W_d)", "m/s^2"),
}
COUNTS = {
    "gaps": "gaps",
    "missing_rows": "missing rows",
    "nan_rows": "rows with empty or NaN cells",
    "stuck_rows": "rows with a channel stuck",
    "standing_rows": "rows at standstill",
    "short_stretches": "stretches too short",
    "unused_rows": "rows not used",
}


def title(kind: str) -> str:
    """The words for a kind of effect."""
    return "no effect added" if kind == "none" else str(core.record(kind)["title"])


def write_page(found: LoopResult, report: Report, path: str | Path) -> Path:
    """Write report.html of a loop: figures inside, nothing fetched from elsewhere."""
    return write_text(path, page(found, report))


def page(found: LoopResult, report: Report) -> str:
    """The page as text."""
    return rendered("loop/page.html.j2", contents(found, report))


def contents(found: LoopResult, report: Report) -> Row:
    """All that the template shows, as words and pictures."""
    window = figures.telling(found)
    kind = found.nominal.design.kind
    band = found.measurement.campaign.band
    return {
        "report": report,
        "verdict": VERDICTS[report["verdict"]],
        "errors": errors(report),
        "bars": figures.error_bars(report),
        "effects": effects(report, laws.law_figures(found, report, window)),
        "channels": channels(found, window),
        "main": MAIN,
        "lines": [w for w in ("measured", "before", "after") if w in figures.raw_series(found, window.index)],
        "window": {"file": window.stretch.file, "speed": None if kind == "rig" else number(window.stretch.mean_speed)},
        "band": f"{band[0]:g} to {band[1]:g} Hz" if band else None,
        "ranking": ranking(report),
        "classes": [[title(k) for k in one] for one in report["classes"] if len(one) > 1],
        "traces": [candidate(row) for row in report.get("traces", ())],
        "parameters": parameters(report),
        "profiles": profiled(report),
        "riding": riding(report),
        "detectable": detectable(report),
        "rig": kind == "rig",
        "power": sorted({f"{100 * r['power']:.0f} %" for r in report["detectable"] if r["power"]}),
        "runs": [run(r) for r in report["runs"]],
        "means": means(report, figures.units_of(found, window.stretch)),
        "floor": floor(report),
        "gate": gate(report),
        "identifiability": identified(report),
        "notes": notes(report),
        "provenance": provenance(report),
    }


def errors(report: Report) -> Row:
    """Rows declared, before, after, floor: overall, over the floor, every channel."""
    names = list(report["declared"]["channels"])
    base = report["floor"]["nrmse"]
    given = [v for w in WHICH for v in (report[w]["nrmse"], *report[w]["channels"].values()) if v]
    decimals = 3 if min(given, default=1.0) >= 0.01 else 4 if min(given) >= 1e-3 else 6
    same, rows = report["after"]["nrmse"] == report["before"]["nrmse"], []
    for which in WHICH:
        one = report[which]
        total, held = one["nrmse"], ", held stable" if one.get("constrained") else ""
        rows.append(
            {
                "which": which,
                "meaning": "nothing was added" if which == "after" and same else MEANING[which] + held,
                "all": f"{total:.{decimals}f}" if total is not None else "diverged",
                "ratio": f"{total / base:.2f}" if total is not None and base else DASH,
                "channels": [DASH if (v := one["channels"].get(c)) is None else f"{v:.{decimals}f}" for c in names],
            }
        )
    return {"channels": names, "rows": rows}


def effects(report: Report, laws: Sequence[laws.Law]) -> list[Row]:
    """The measured curve of `outside`, then every effect of the vehicle as found: its numbers and its law."""
    curve = [{"law": laws[0], "parameters": [], "source": ""}] if report["outside"] else []
    return curve + [
        {
            "law": law,
            "source": core.record(e["kind"])["source"],
            "parameters": [
                *(_quantity(key.replace("_", " "), p) for key, p in e["parameters"].items()),
                *(_quantity(f"phase on {phase_of(p)}", p) for p in e["phases"]),
            ],
        }
        for e, law in zip(report["effects"], laws[len(curve) :], strict=True)
    ]


def _quantity(name: str, p: Mapping[str, Any]) -> Row:
    factor, unit = scale(p["value"], p["unit"])
    sd = None if p["sd"] is None else factor * p["sd"]
    return {"name": name, "value": with_sd(factor * p["value"], sd), "unit": unit}


def channels(found: LoopResult, window: figures.Window) -> list[Row]:
    """Series and spectrum of every compared channel, those that tell most first."""
    known, shown = columns_of(window.stretch.kind), figures.shown_channels(window.stretch)
    pictures = figures.channel_pictures(found, window, shown)
    return [
        {"name": c, "caption": known[c].caption, "series": series, "spectrum": spectrum}
        for c, (series, spectrum) in zip(shown, pictures, strict=True)
    ]


def ranking(report: Report) -> Row:
    """The best candidates, and nothing added wherever it stands."""
    rows = report["ranking"]
    nothing = next((r["nrmse"] for r in rows if r["kind"] == "none"), None)
    shown = [(i, r) for i, r in enumerate(rows, 1) if i <= TOP or r["kind"] == "none"]
    widest = max([r["nrmse"] for _, r in shown if r["nrmse"]], default=0.0)
    return {"rows": [candidate(r, widest, nothing) | {"rank": i} for i, r in shown], "count": len(rows)}


def candidate(row: Mapping[str, Any], widest: float = 0.0, nothing: float | None = None) -> Row:
    """One candidate in words, with bars in per cent; hollow where it is estimated, faint where it gains nothing."""
    rho, error, none = row["rho"], row["nrmse"], row["kind"] == "none"
    idle = not none and None not in (nothing, error) and error >= nothing
    return {
        "title": title(row["kind"]),
        "none": none,
        "place": place(row["at"], row["wheelset"]) if row["at"] else "",
        "rho": DASH if none or rho is None else f"{rho:.2f}".replace("-", "−"),
        "rho_width": f"{100 * min(1.0, abs(rho or 0.0)):.1f}",
        "nrmse": number(error),
        "nrmse_width": f"{100 * min(1.0, (error or 0.0) / widest):.1f}" if widest else "0",
        "bar": ("" if row.get("refitted", True) else " guess") + (" idle" if idle else ""),
        "refitted": row.get("refitted", True),
        "weight": f"{100 * row['weight']:.0f} %" if row.get("weight") else "",
        "p": number(row.get("p"), 2),
    }


def parameters(report: Report) -> list[Row]:
    """Every adjusted parameter in one unit per row, with what the data say of it."""
    rows = []
    profiles = (report.get("profiles") or {}).get("parameters", {})
    for path, p in report["parameters"].items():
        factor, unit = scale([p["declared"], p["before"], p["value"]], p["unit"])
        word, grade = FLAGS[p["flag"]]
        change = (p["value"] / p["declared"] - 1.0) * 100 if p["declared"] and p["value"] is not None else None
        rows.append(
            {
                "path": path,
                "caption": PARAMETERS[path].caption if path in PARAMETERS else "",
                "declared": number(_times(factor, p["declared"])),
                "before": number(_times(factor, p["before"])),
                "value": with_sd(_times(factor, p["value"]), _times(factor, p["sd"])),
                "profiles": number(_times(factor, profiles.get(path))),
                "unit": unit,
                "change": DASH if change is None else signed(change, 0),
                "flag": word,
                "grade": grade,
            }
        )
    return rows


def profiled(report: Report) -> Row | None:
    """What is said of the measured profiles above the parameters."""
    found = report.get("profiles")
    if not found:
        return None
    e1, e2 = (f"{1e3 * sd:.2g}" for sd in found["deviation"])
    return {**found, "e1": e1, "e2": e2, "surface": f"{found['surface']:g} times"}


def _times(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value


def riding(report: Report) -> list[Row]:
    """Riding quality measured and as the models compute it, with the deviation of each."""
    which = ("measured", "declared", "before", "after")
    rows = []
    for key, (words, unit) in RIDING.items():
        values = [report["riding"].get(w, {}).get(key) for w in which]
        if all(v is None for v in values):
            continue
        factor, name = scale(values, unit)
        measured = values[0]
        cells = [{"value": number(_times(factor, v)), "off": ""} for v in values]
        for cell, v in zip(cells[1:], values[1:], strict=True):
            if measured and v is not None:
                cell["off"] = signed(100 * (v / measured - 1.0), 1)
        rows.append({"words": words, "unit": name, "cells": cells})
    return rows


def detectable(report: Report) -> list[Row]:
    """The smallest of every effect that would have been seen; one row per kind, place and parameter."""
    order = {r["kind"]: i for i, r in enumerate(core.catalogue())}
    found: dict[tuple[str, str, str], dict[int | None, str]] = {}
    for r in sorted(report["detectable"], key=lambda r: (order[r["kind"]], r["at"], r["parameter"])):
        row = found.setdefault((r["kind"], r["at"], r["parameter"]), {})
        factor, unit = scale(r["value"], r["unit"])
        row[r["wheelset"]] = DASH if r["value"] is None else f"{number(factor * r['value'])} {unit}".strip()
    rows, last = [], ""
    for (kind, at, parameter), row in found.items():
        rows.append(
            {"title": title(kind), "new": kind != last, "place": place(at), "parameter": parameter.replace("_", " "),
             "values": [row.get(w, "") for w in (None, 1, 2)]}
        )  # fmt: skip
        last = kind
    return rows


def run(r: Mapping[str, Any]) -> Row:
    """A run with what was left out of it."""
    counts = r.get("counts", {})
    return {
        "file": r["file"],
        "role": r["role"],
        "samples": r["samples"],
        "used": counts.get("used", DASH),
        "stretches": r["stretches"],
        "gaps": counts.get("gaps", DASH),
        "left_out": "; ".join(f"{counts[k]} {words}" for k, words in COUNTS.items() if k != "gaps" and counts.get(k)),
        "ignored": ", ".join(r.get("ignored", ())),
    }


def means(report: Report, units: Mapping[str, str]) -> list[Row]:
    """Mean of measured less simulated, which no band sees."""
    rows = []
    for c, value in report["means"].items():
        factor, unit = scale(value, units[c])
        rows.append({"name": c, "value": number(_times(factor, value), 2), "unit": unit})
    return rows


def floor(report: Report) -> Row:
    """The noise floor in words."""
    f = report["floor"]
    return {
        "nrmse": number(f["nrmse"]),
        "sd": number(f["sd"], 2),
        "sensors_only": number(f["sensors_only"]),
        "source": "as declared in the campaign" if f["source"] == "declared" else "estimated from the runs",
        "unexplained": DASH if report["unexplained"] is None else f"{report['unexplained']:.2f}",
    }


def gate(report: Report) -> Row:
    """What was found in the data themselves, and per run what no linear vehicle can follow."""
    found = report.get("gate", ())
    ceilings: dict[str, list[tuple[str, str]]] = {}
    for f in found:
        if f["check"] == "ceiling":
            ceilings.setdefault(f["file"], []).append((f["channel"], number(f["value"], 2)))
    return {"findings": [f for f in found if f["check"] != "ceiling"], "ceilings": ceilings}


def identified(report: Report) -> Row | None:
    """What the motions determine, in words, and the span of the singular values."""
    found = report.get("identifiability")
    if not found or not found["singular_values"]:
        return None
    values = found["singular_values"]
    return {"words": found["words"], "strongest": number(values[0], 2), "weakest": number(values[-1], 2)}


def notes(report: Report) -> list[str]:
    """Notes of the loop and where a vehicle diverged."""
    found = list(report.get("notes", ()))
    for which in WHICH:
        lost = report[which].get("diverged")
        text = lost and f"{which}: the vehicle diverges on {lost['file']} at {lost['at_s']:.2f} s, its error is null"
        if text and text not in found:
            found.append(text)
    return found


def provenance(report: Report) -> Sequence[tuple[str, str]]:
    """What made this page: version, kernel, seed, and the hash of every input."""
    rows = [
        ("railui", f"{report['version']}, kernel {core.sources()}"),
        ("SIMD level", str(report["simd"])),
        ("seed", str(report["seed"])),
        ("effort", f"{number(report['seconds'])} s" + _simulations(report)),
    ]
    rows += [(f"sha256 of {Path(i['file']).name}", i["sha256"]) for i in report.get("inputs", ())]
    rows += [(f"sha256 of {r['file']}", r["sha256"]) for r in report["runs"]]
    return rows


def _simulations(report: Report) -> str:
    return f", {report['simulations']} simulations in the fits kept" if report.get("simulations") else ""
