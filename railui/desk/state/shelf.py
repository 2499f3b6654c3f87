"""Shelf of designs: up to 26 designs A to Z with notes and the history of their changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from string import ascii_uppercase

from railui.vehicle.design_reader import Design


class ShelfFullError(ValueError):
    """Every letter of the shelf is taken."""


@dataclass(frozen=True)
class ShelfItem:
    """Design of the shelf.

    origin: its file, or the proposed one; time: when it was put there; history: descriptions of the changes since the
    design was opened.
    """

    letter: str
    design: Design
    note: str = ""
    origin: str = ""
    time: str = ""
    history: tuple[str, ...] = ()


@dataclass
class Shelf:
    """Designs in the order of their letters.

    >>> from railui.vehicle.design_reader import parse_design
    >>> design = parse_design("vehicle: {rig: {mass: 95 kg}}")
    >>> shelf = Shelf()
    >>> shelf.keep(design).letter, shelf.keep(design).letter
    ('A', 'B')
    >>> shelf.remove("A")
    >>> shelf.keep(design).letter
    'A'
    """

    items: list[ShelfItem] = field(default_factory=list)

    def keep(
        self, design: Design, *, note: str = "", origin: str = "", time: str = "", history: Sequence[str] = ()
    ) -> ShelfItem:
        """Put a design on the shelf under the first free letter; raise ShelfFullError without one."""
        taken = {item.letter for item in self.items}
        letter = next((letter for letter in ascii_uppercase if letter not in taken), None)
        if letter is None:
            raise ShelfFullError("all 26 letters are taken: remove a design from the shelf first")
        item = ShelfItem(letter, design, note, origin, time, tuple(history))
        self.items = sorted([*self.items, item], key=lambda each: each.letter)
        return item

    def item(self, letter: str) -> ShelfItem | None:
        """Return the design of a letter, or None."""
        return next((item for item in self.items if item.letter == letter), None)

    def set_note(self, letter: str, note: str) -> None:
        """Change the note of a design."""
        self.items = [replace(item, note=note) if item.letter == letter else item for item in self.items]

    def remove(self, letter: str) -> None:
        """Take a design off the shelf."""
        self.items = [item for item in self.items if item.letter != letter]
