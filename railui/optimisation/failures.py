"""Failures of the designs of a search in words: their reasons, and the outcome where no design is left."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

MAX_REASONS: Final = 3  # in one line


def failure_reasons(failures: Mapping[str, int]) -> str:
    """Return the reasons with their numbers of designs, most frequent first, the first three.

    >>> failure_reasons({"left the track": 4, "too stiff to be stepped": 27})
    'too stiff to be stepped (27), left the track (4)'
    >>> failure_reasons({"a": 1, "b": 4, "c": 3, "d": 2, "e": 1})
    'b (4), c (3), d (2), other reasons (2)'
    """
    ranked = sorted(failures.items(), key=lambda item: (-item[1], item[0]))
    parts = [f"{reason} ({count})" for reason, count in ranked[:MAX_REASONS]]
    others = sum(count for _, count in ranked[MAX_REASONS:])
    return ", ".join([*parts, *([f"other reasons ({others})"] if others else [])])


def all_failed(result: Mapping[str, Any]) -> bool:
    """Return True for the result of a search all of whose designs failed."""
    return bool(0 < result["evaluations"] == result["failed"])


def failure_line(result: Mapping[str, Any]) -> str:
    """Return how many designs of a search failed and why; "" if none did."""
    if not result["failed"]:
        return ""
    count = f"all {result['failed']}" if all_failed(result) else f"{result['failed']} of {result['evaluations']}"
    return f"{count} designs failed: {failure_reasons(result['failures'])}"
