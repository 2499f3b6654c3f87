"""Correction of data faults: one that the data decide is made at once, of several the user chooses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from textual.app import App

from railui.campaign.campaign import Campaign
from railui.campaign.corrections.correction import Corrections
from railui.campaign.corrections.reading import read_corrections
from railui.campaign.faults.fault import Diagnosis, Fault
from railui.desk.widgets.dialogs import ChoiceDialog
from railui.io.problems import Findings
from railui.io.yaml_document import parse_yaml


class DataCorrector:
    """Choice of the corrections of a campaign; `then` receives the campaign with those that were chosen.

    Corrections that the data decide are left to the loop, which reports them.
    """

    def __init__(
        self, app: App[Any], campaign: Campaign, diagnosis: Diagnosis, then: Callable[[Campaign], object]
    ) -> None:
        self.app, self.campaign, self.then = app, campaign, then
        self.open = [fault for fault in diagnosis.serious if fault.alternatives]
        self.without = [fault for fault in diagnosis.serious if not fault.corrections]

    def start(self) -> None:
        """Ask for the correction of every fault that has several, then go on; say so if a fault has none."""
        if self.without:
            texts = "; ".join(fault.text for fault in self.without)
            self.app.notify(f"no correction is known: {texts}", severity="warning", timeout=10)
            return
        self._ask(self.open)

    def _ask(self, faults: Sequence[Fault]) -> None:
        if not faults:
            self.then(self.campaign)
            return
        fault, *others = faults
        lines = [line for line in (fault.yaml, *fault.alternatives) if line is not None]

        def on_answer(line: str | None) -> None:
            if line is not None:
                chosen = corrections_of_line(line, self.campaign)
                self.campaign = replace(self.campaign, corrections=self.campaign.corrections.joined(chosen))
                self._ask(others)

        title = f"{fault.text}: these data cannot tell which correction"
        self.app.push_screen(ChoiceDialog(title, [(line, line) for line in lines]), on_answer)


def corrections_of_line(line: str, campaign: Campaign) -> Corrections:
    """Return the corrections that a line of a campaign file makes."""
    findings = Findings("correction")
    raw = parse_yaml(line, "correction").value["sensors"]
    corrections = read_corrections(raw, campaign.design.run_form, [run.name for run in campaign.runs], findings)
    findings.raise_errors()
    return corrections
