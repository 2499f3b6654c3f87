"""Messages from background jobs to panels, and from one panel to another."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from textual.message import Message

from railui.desk.presenters.design_results import DesignResults
from railui.vehicle.design_reader import Design


@dataclass
class DesignsEvaluated(Message):
    """Results of a design and of the base it is compared with; `is_addition`: earlier results with curving added."""

    current: DesignResults
    base: DesignResults
    is_addition: bool = False


@dataclass
class JobFailed(Message):
    """End of a job without a result."""

    name: str
    text: str
    is_stopped: bool = False


@dataclass
class ProgressEvent(Message):
    """Intermediate result of a running job."""

    name: str
    event: Any


@dataclass
class ProgressMessage(Message):
    """Line of text from a running job."""

    name: str
    text: str


@dataclass
class JobDone(Message):
    """End of a job with its result."""

    name: str
    result: Any


@dataclass
class DesignOffered(Message):
    """Design from a loop or a search, to be opened in the form with the nominal design as its base.

    new_path: proposed file of the design, which has none yet.
    """

    description: str
    design: Design
    nominal: Design
    new_path: Path


@dataclass
class PartChanged(Message):
    """Part of the session that the autosave stores has changed: plan, search, verdict or shelf."""

    part: str


@dataclass
class FileOffered(Message):
    """File that a panel has written, to be opened in its own panel."""

    path: Path
