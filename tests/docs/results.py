"""Compare the tables of docs/results.md with documents of the commands: keys without a row, rows without a key."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any

from tests.docs.transcript import ROOT

PAGE = ROOT / "docs" / "results.md"
ROW = re.compile(r"^\| `([^`]+)` \|[^|]*\| ?(.*) \|$", re.M)
COMMON_SECTION = "Every document"

Key = tuple[str, ...]


def sections() -> dict[str, dict[str, str]]:
    """Return the rows of every section: heading -> key -> meaning."""
    parts = re.split(r"^## ", PAGE.read_text(), flags=re.M)[1:]
    return {part.partition("\n")[0].removeprefix("railui "): dict(ROW.findall(part)) for part in parts}


def rows_of(*headings: str) -> dict[str, str]:
    """Return the rows of some sections together with those of every document."""
    tables = sections()
    return {key: meaning for heading in (COMMON_SECTION, *headings) for key, meaning in tables[heading].items()}


def key_paths(node: Any, key: Key = ()) -> Iterator[tuple[Key, bool]]:
    """Yield every key path of a document, with 0 for list items, and whether its value is empty or null."""
    if isinstance(node, dict) and node:
        for name, inner in node.items():
            yield from key_paths(inner, (*key, name))
    elif isinstance(node, list) and any(isinstance(item, dict | list) for item in node):
        for item in node:
            yield from key_paths(item, (*key, "0"))
    else:
        yield key, node in (None, [], {})


def is_row_of(row: str, key: Key) -> bool:
    """Return whether a row documents a key: NAME matches any name, a final KEY all keys below."""
    words = row.split(".")
    if words[-1] == "KEY" and len(key) > len(words):
        key = key[: len(words)]
    return len(words) == len(key) and all(w.isupper() or w == k for w, k in zip(words, key, strict=True))


def is_below(row: str, key: Key) -> bool:
    """Return whether a row lies below a key, which is empty or null in a document."""
    return is_row_of(".".join(row.split(".")[: len(key)]), key)


def undocumented_keys(documents: Iterable[Any], rows: Iterable[str]) -> list[str]:
    """Return the keys without a row."""
    keys = {key: empty for document in documents for key, empty in key_paths(document)}
    known = list(rows)
    return sorted(
        ".".join(key)
        for key, empty in keys.items()
        if not any(is_row_of(row, key) or (empty and is_below(row, key)) for row in known)
    )


def superfluous_rows(documents: Iterable[Any], rows: dict[str, str]) -> list[str]:
    """Return the rows without a key in any document, except those whose meaning begins with "where"."""
    keys = [pair for document in documents for pair in key_paths(document)]
    return sorted(
        row
        for row, meaning in rows.items()
        if not meaning.startswith("where ")
        and not any(is_row_of(row, key) or (empty and is_below(row, key)) for key, empty in keys)
    )
