"""Any text is read or rejected with FileProblems."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from railui.documents.check import load
from railui.io.problems import FileProblems
from railui.io.yaml_document import parse_yaml
from railui.io.yaml_edit import edit_values

PIECES = [
    "",
    "null",
    "[]",
    "{}",
    "-1",
    "on",
    "3 kN",
    ".nan",
    "1e999",
    "&a ",
    "*a",
    "<<: 1",
    "- ",
    ": ",
    "\n",
    "  ",
    "#",
    "\t",
    "'",
    '"',
    "!x ",
    "ä",
    "%",
    "}",
    "]",
    ",",
    ";",
    "abc",
    "\x00",
    "0o8",
    "nan",
]
slips = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 12), st.sampled_from(PIECES)), min_size=1, max_size=3)
quick = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


def slipped(text: str, edits: list[tuple[float, int, str]]) -> str:
    """The text with pieces of it replaced."""
    for where, length, piece in edits:
        i = int(where * len(text))
        text = text[:i] + piece + text[i + length :]
    return text


def leaves(value: Any, at: str) -> Iterator[tuple[str, Any]]:
    """Values that are not groups, by dotted path."""
    if value and isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(inner, f"{at}.{key}")
    else:
        yield at, value


def values_elsewhere(value: Any, path: str) -> str:
    """Values neither at a path nor below nor above it."""
    there = f".{path}."
    return repr([(p, x) for p, x in leaves(value, "") if not (f"{p}.".startswith(there) or there.startswith(f"{p}."))])


def read_or_told(path: Path) -> None:
    try:
        load(path)
    except FileProblems as error:
        assert error.problems and all(p.message for p in error.problems)


@quick
@given(edits=slips)
def test_a_design_with_random_edits_is_read_or_rejected(
    bogie: str, tmp_path: Path, edits: list[tuple[float, int, str]]
) -> None:
    (tmp_path / "vehicle.yaml").write_text(slipped(bogie, edits))
    read_or_told(tmp_path / "vehicle.yaml")


@quick
@given(edits=slips)
def test_a_campaign_with_random_edits_is_read_or_rejected(
    campaign_folder: Path, edits: list[tuple[float, int, str]]
) -> None:
    path = campaign_folder / "campaign.yaml"
    whole = path.read_text()
    path.write_text(slipped(whole, edits))
    read_or_told(path)
    path.write_text(whole)


@quick
@given(edits=slips)
def test_a_run_with_random_edits_is_read_or_rejected(
    columns: Callable[..., dict[str, np.ndarray]],
    as_csv: Callable[..., str],
    tmp_path: Path,
    edits: list[tuple[float, int, str]],
) -> None:
    (tmp_path / "run.csv").write_text(slipped(as_csv(columns(12.0)), edits))
    read_or_told(tmp_path / "run.csv")


@quick
@given(
    edits=slips,
    path=st.sampled_from(["name", "vehicle.wheel_load", "contact.leading.roll", "effects.0.x", "a.b"]),
    value=st.sampled_from([1.5, "x", [1], {"a": 2}, True]),
)
def test_an_edit_changes_the_requested_path_only_or_is_rejected(
    bogie: str, edits: list[Any], path: str, value: Any
) -> None:
    text = slipped(bogie, edits)
    try:
        before = parse_yaml(text)
    except FileProblems:
        return
    try:
        after = parse_yaml(edit_values(text, {path: value}))
    except FileProblems:
        return
    assert values_elsewhere(after.value, path) == values_elsewhere(before.value, path)
    asked = [(p, x) for p, x in leaves(after.value, "") if f"{p}.".startswith(f".{path}.")]
    in_its_old_unit = value == 1.5 and len(asked) == 1 and isinstance(asked[0][1], str)
    assert in_its_old_unit or asked == list(leaves(value, f".{path}"))
