"""Faults of the data and the diagnosis of a campaign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

from railui.campaign.corrections.correction import Corrections, yaml_line
from railui.campaign.finding import Finding

NO_CORRECTIONS = Corrections()


@dataclass(frozen=True)
class Fault:
    """A fault of the recorded data.

    Attributes
    ----------
    kind
        sign, unit, gain, delay, clock, track_offset, exchanged, gravity, clipping, dropouts, hum, intermittent; of a
        rig also absolute (acceleration), input (absent) or duration.
    value, sd, unit
        Size of the fault with its standard deviation; None where it has none.
    files
        Names of the runs concerned.
    serious
        True if no fit should use the data as they are.
    corrections
        Corrections that undo it; empty if there is none.
    alternatives
        YAML lines of other corrections that explain the data equally well.
    remedy
        Measure outside the campaign file; empty if there is none beyond the usual ones.
    interval
        Start and end [s] of a fault during a part of a run; None: the whole run.
    """

    kind: str
    channels: tuple[str, ...]
    value: float | None
    sd: float | None
    unit: str
    files: tuple[str, ...]
    text: str
    serious: bool
    corrections: Corrections = NO_CORRECTIONS
    alternatives: tuple[str, ...] = ()
    remedy: str = ""
    interval: tuple[float, float] | None = None

    @property
    def yaml(self) -> str | None:
        """Line of the campaign file that corrects the fault; None if no correction is known."""
        return yaml_line(self.corrections) if self.corrections else None

    @property
    def is_correctable(self) -> bool:
        """True if one correction explains the data better than any other."""
        return bool(self.corrections) and not self.alternatives

    def finding(self) -> Finding:
        """Return the fault as a finding of the data checks."""
        check = {"delay": "clock", "unit": "gain"}.get(self.kind, self.kind)
        value = 0.0 if self.value is None else self.value
        text = f"{self.text}: {self.remedy}" if self.remedy else self.text
        start, end = self.interval or (None, None)
        files, channels = ", ".join(self.files), ", ".join(self.channels)
        return Finding(check, files, channels, value, self.unit, text, self.serious, start, end)


@dataclass(frozen=True)
class Diagnosis:
    """Faults of a campaign's data, serious ones first."""

    faults: tuple[Fault, ...] = ()

    @property
    def serious(self) -> tuple[Fault, ...]:
        """Faults with which no fit should begin."""
        return tuple(f for f in self.faults if f.serious)

    @property
    def is_correctable(self) -> bool:
        """True if every serious fault has one correction."""
        return all(f.is_correctable for f in self.serious)

    @property
    def corrections(self) -> Corrections:
        """Corrections of all serious faults together."""
        return reduce(Corrections.joined, (f.corrections for f in self.serious), Corrections())

    def findings(self) -> list[Finding]:
        """Return the faults as findings of the data checks."""
        return [f.finding() for f in self.faults]


def ordered(faults: Sequence[Fault]) -> Diagnosis:
    """Return a diagnosis with the serious faults first."""
    return Diagnosis(tuple(sorted(faults, key=lambda f: not f.serious)))
