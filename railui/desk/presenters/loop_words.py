"""The words of a loop: what the gate found about the data, what the motions determine, where the vehicle hunts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.text import Text

from railui.campaign.finding import Finding
from railui.desk.presenters.loop_views import short
from railui.identification.estimation.identifiability import COMBINED, DETERMINED, ROUGH, UNSEEN

CEILING = "ceiling"  # the check that tells what no linear model explains, of every channel of every run
HALF = 0.5  # from this share on a channel is more of something else than of the track
COLOURS = {DETERMINED: "green", ROUGH: "yellow", COMBINED: "yellow", UNSEEN: "red"}


def gate_text(findings: Sequence[Finding]) -> Text:
    """What is wrong with the data, the serious first; below, what of each channel no linear model explains."""
    text = Text()
    told = [f for f in findings if f.check != CEILING]
    if not told:
        text.append("Clocks, gains, signs, gaps: nothing found.\n", "green")
    for f in told:
        if f.serious:
            text.append("check this first: ", "bold red")
        text.append(f"{f.file}: {f.text}{_place(f)}\n", "" if f.serious else "yellow")
    ceilings = [f for f in findings if f.check == CEILING]
    if ceilings:
        text.append("\nNot coherent with the track (nonlinear, unmeasured, noise, changing speed):\n", "dim")
        text.append_text(_table(ceilings))
    text.rstrip()
    return text


def _place(f: Finding) -> str:
    """From when to when, where a finding has a place and does not say it itself."""
    if f.start is None or f.end is None or f"{f.start:.0f}" in f.text:
        return ""
    return f" (from {f.start:.1f} to {f.end:.1f} s)"


def _table(ceilings: Sequence[Finding]) -> Text:
    """A row per channel, a column per run, shares in per cent."""
    files = list(dict.fromkeys(f.file for f in ceilings))
    shares = {(f.channel, f.file): f.value for f in ceilings}
    text = Text("  % " + "".join(f"{file.split('.')[0][:7]:>8}" for file in files) + "\n", "dim")
    for channel in dict.fromkeys(f.channel for f in ceilings):
        text.append(f"{channel:4}")
        for file in files:
            value = shares.get((channel, file))
            told = "-" if value is None else f"{100 * value:.0f}"
            text.append(f"{told:>8}", "yellow" if (value or 0) > HALF else "")
        text.append("\n")
    return text


def determined_text(report: Mapping[str, Any]) -> Text:
    """What the motions determine of each parameter in words, and the notes: on which runs the vehicle hunts."""
    text = Text()
    rows = report["identifiability"]["parameters"]
    for word in COLOURS:
        found = [(path, row) for path, row in rows.items() if row["word"] == word]
        if found:
            text.append(f"{word}: ", f"bold {COLOURS[word]}")
            text.append(", ".join(_named(path, row) for path, row in found) + "\n")
    for note in report["notes"]:
        text.append(f"{note}\n", "yellow")
    text.rstrip()
    return text


def summary(report: Mapping[str, Any]) -> str:
    """How many parameters the motions determine, and how well, in a few words."""
    words = [row["word"] for row in report["identifiability"]["parameters"].values()]
    few = {DETERMINED: "determined", ROUGH: "roughly", COMBINED: "in combination", UNSEEN: "unseen"}
    return ", ".join(f"{words.count(word)} {told}" for word, told in few.items() if word in words)


def hunting_note(report: Mapping[str, Any]) -> str:
    """On which runs the vehicle hunts and was adjusted on windows; nothing where it does not."""
    found = report["windows"]
    if found is None:
        return ""
    return f"It hunts on {', '.join(found['runs'])}: adjusted there on windows of {found['seconds']:g} s."


def _named(path: str, row: Mapping[str, Any]) -> str:
    """A parameter, with its standard deviation where it is rough, with its partners where they go together."""
    if row["word"] == COMBINED:
        return f"{short(path)} (with {' and '.join(short(p) for p in row['with'])})"
    sd = row["relative_sd"]
    return short(path) if sd is None or row["word"] == UNSEEN else f"{short(path)} {100 * sd:.2g} %"
