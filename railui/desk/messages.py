"""What workers tell the desk, and what one panel hands to another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from textual.message import Message

from railui.desk.presenters.look import Look
from railui.vehicle.design_reader import Design


@dataclass
class Seen(Message):
    """A design was looked at, and what it is compared with."""

    look: Look
    base: Look


@dataclass
class Failed(Message):
    """A piece of work ended without its result."""

    name: str
    text: str
    stopped: bool = False


@dataclass
class Showed(Message):
    """Something that a study showed while it worked."""

    name: str
    event: Any


@dataclass
class Line(Message):
    """A line that a study told."""

    name: str
    text: str


@dataclass
class Done(Message):
    """A study ended with its result."""

    name: str
    result: Any


@dataclass
class Offered(Message):
    """A design found by a study, to be taken into the form beside the declared one that it came from."""

    what: str
    design: Design
    declared: Design
