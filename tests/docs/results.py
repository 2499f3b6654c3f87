"""The tables of docs/results.md, held against documents of the commands: which keys have no row, which rows no key."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any

from tests.docs.transcript import ROOT

PAGE = ROOT / "docs" / "results.md"
ROW = re.compile(r"^\| `([^`]+)` \|[^|]*\| ?(.*) \|$", re.M)
ENVELOPE = "Every document"

Key = tuple[str, ...]


def sections() -> dict[str, dict[str, str]]:
    """Rows of every section: its heading -> key as it is written -> meaning."""
    parts = re.split(r"^## ", PAGE.read_text(), flags=re.M)[1:]
    return {part.partition("\n")[0].removeprefix("railui "): dict(ROW.findall(part)) for part in parts}


def rows_of(*headings: str) -> dict[str, str]:
    """The rows of some sections together, the envelope among them."""
    told = sections()
    return {key: meaning for heading in (ENVELOPE, *headings) for key, meaning in told[heading].items()}


def leaves(node: Any, key: Key = ()) -> Iterator[tuple[Key, bool]]:
    """Every key of a document down to what is no map, items of lists as 0; is it empty or null?"""
    if isinstance(node, dict) and node:
        for name, inner in node.items():
            yield from leaves(inner, (*key, name))
    elif isinstance(node, list) and any(isinstance(item, dict | list) for item in node):
        for item in node:
            yield from leaves(item, (*key, "0"))
    else:
        yield key, node in (None, [], {})


def fits(row: str, key: Key) -> bool:
    """Is this the row of a key? Words in capitals stand for any name; KEY at the end for all below it."""
    words = row.split(".")
    if words[-1] == "KEY" and len(key) > len(words):
        key = key[: len(words)]
    return len(words) == len(key) and all(w.isupper() or w == k for w, k in zip(words, key, strict=True))


def within(row: str, key: Key) -> bool:
    """Is the row below a key that is empty or null here?"""
    return fits(".".join(row.split(".")[: len(key)]), key)


def undocumented(documents: Iterable[Any], rows: Iterable[str]) -> list[str]:
    """Keys that no row tells of."""
    found = {key: empty for one in documents for key, empty in leaves(one)}
    known = list(rows)
    return sorted(
        ".".join(key)
        for key, empty in found.items()
        if not any(fits(row, key) or (empty and within(row, key)) for row in known)
    )


def unheard_of(documents: Iterable[Any], rows: dict[str, str]) -> list[str]:
    """Rows that no document has a key for, but those of keys that are there only "where" something is asked for."""
    found = [pair for one in documents for pair in leaves(one)]
    return sorted(
        row
        for row, meaning in rows.items()
        if not meaning.startswith("where ")
        and not any(fits(row, key) or (empty and within(row, key)) for key, empty in found)
    )
