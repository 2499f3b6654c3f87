"""YAML 1.2: scalars of the core schema and positions of values."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from railui.io.problems import FileProblems, Problem
from railui.io.yaml_document import MAX_BYTES, load_yaml, parse_yaml

ProblemsOf = Callable[[Callable[[], object]], list[Problem]]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e6", 1e6),
        ("on", "on"),
        ("off", "off"),
        ("yes", "yes"),
        ("no", "no"),
        ("y", "y"),
        ("true", True),
        ("False", False),
        ("0o17", 15),
        ("017", 17),
        ("0x1F", 31),
        ("1_000", "1_000"),
        ("1:30", "1:30"),
        ("2001-01-01", "2001-01-01"),
        ("~", None),
        ("null", None),
        (".5", 0.5),
        ("-2.", -2.0),
        ("+3", 3),
        (".inf", float("inf")),
        ("9" * 400, float("inf")),
        ("0x" + "F" * 6000, float("inf")),
        ("0o" + "7" * 6000, float("inf")),
        ("5 mm", "5 mm"),
        ("=", "="),
        ("<<", "<<"),
        ("'5'", "5"),
        ('"on"', "on"),
        ("!!str 5", "5"),
        ("!!float 3", 3.0),
    ],
)
def test_scalars_follow_the_core_schema_of_yaml_1_2(text: str, value: object) -> None:
    read = parse_yaml(f"a: {text}").value["a"]
    assert read == value and type(read) is type(value)


def test_positions_count_lines_and_columns_from_one() -> None:
    document = parse_yaml("a:\n  b: {c: 1, d: [x, yy]}\n")
    assert document.positions["a.b"] == (2, 6)
    assert document.positions["a.b.c"] == (2, 10)
    assert document.key_positions["a.b.d"] == (2, 13)
    assert document.positions["a.b.d.1"] == (2, 20)


def test_positions_count_characters_not_bytes() -> None:
    assert parse_yaml("é: {ü: 3}").positions["é.ü"] == (1, 8)


def test_every_duplicate_key_is_reported_at_once(problems_of: ProblemsOf) -> None:
    found = problems_of(lambda: parse_yaml("a: 1\nb: {c: 1, c: 2}\na: 3\n", "f.yaml"))
    assert [(p.line, p.column, p.key) for p in found] == [(2, 11, "b.c"), (3, 1, "a")]
    assert str(found[1]) == "f.yaml:3:1: a: occurs twice (first in line 1), keep one of them"


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [
        ("a: [1", 2, 1),
        ("a: *x", 1, 4),
        ("---\na: 1\n---\nb: 2", 3, 1),
        ("", 1, 1),
        ("# nothing\n", 1, 1),
        ("a: !!python/object:os.system {}", 1, 4),
        ("a: !mine 1", 1, 4),
        ("? [a, b]\n: 1", 1, 3),
        ("a:\tb: c", 1, 5),
    ],
)
def test_unsupported_yaml_is_rejected_with_its_position(
    text: str, line: int, column: int, problems_of: ProblemsOf
) -> None:
    assert [(p.line, p.column) for p in problems_of(lambda: parse_yaml(text + ("\n" if text == "a: [1" else "")))] == [
        (line, column)
    ]


def test_an_anchor_may_be_used_again() -> None:
    assert parse_yaml("leading: &l {conicity: 0.1}\ntrailing: *l\n").value["trailing"] == {"conicity": 0.1}


def test_twenty_levels_are_read_and_twenty_one_rejected(problems_of: ProblemsOf) -> None:
    parse_yaml("[" * 20 + "]" * 20)
    assert "deeper than 20" in problems_of(lambda: parse_yaml("[" * 21 + "]" * 21))[0].message
    assert "deeper than 20" in problems_of(lambda: parse_yaml("[" * 100_000))[0].message


def test_an_alias_cannot_dig_deeper_than_twenty_levels(problems_of: ProblemsOf) -> None:
    deep = "a: &a " + "[" * 12 + "]" * 12 + "\nb: " + "[" * 12 + "*a" + "]" * 12
    assert "deeper than 20" in problems_of(lambda: parse_yaml(deep))[0].message


def test_an_alias_expansion_attack_is_rejected(problems_of: ProblemsOf) -> None:
    lines = ["a0: &a0 [1,1,1,1,1,1,1,1,1,1]"]
    lines += [f"a{i}: &a{i} [{','.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    assert "more than" in problems_of(lambda: parse_yaml("\n".join(lines)))[0].message


def test_a_recursive_anchor_is_rejected() -> None:
    with pytest.raises(FileProblems):
        parse_yaml("a: &a [*a]")


def test_a_file_above_one_megabyte_is_rejected(tmp_path: Path, problems_of: ProblemsOf) -> None:
    path = tmp_path / "large.yaml"
    path.write_text("a: " + "x" * MAX_BYTES)
    assert "larger than" in problems_of(lambda: load_yaml(path))[0].message


def test_an_invalid_utf8_byte_is_reported_with_its_position(tmp_path: Path, problems_of: ProblemsOf) -> None:
    path = tmp_path / "latin.yaml"
    path.write_bytes("a: 1\nname: Z\xfcrich\n".encode("latin-1"))
    assert [(p.line, p.column) for p in problems_of(lambda: load_yaml(path))] == [(2, 8)]


def test_a_byte_order_mark_is_no_part_of_the_first_key(tmp_path: Path) -> None:
    path = tmp_path / "bom.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\r\nb: 2\r\n")
    assert load_yaml(path).value == {"a": 1, "b": 2}


def test_positions_are_the_same_without_the_compiled_parser(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "é: {ü: 3}  # x\r\nb:\r\n  - [1, 'a b']\r\n  - |\r\n    text\r\nc: &a {d: 1}\r\ne: *a\r\n"
    fast = parse_yaml(text)
    monkeypatch.setattr(yaml, "CSafeLoader", yaml.SafeLoader)
    slow = parse_yaml(text)
    assert (fast.value, fast.positions, fast.key_positions) == (slow.value, slow.positions, slow.key_positions)


plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**9), 10**9)
    | st.floats(allow_nan=False)
    | st.sampled_from(["on", "a b", "1e", "x: y"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("abcd"), inner, max_size=3),
    max_leaves=12,
)


@given(plain)
def test_json_reads_as_itself(value: object) -> None:
    text = json.dumps({"a": value}).replace("-Infinity", "-.inf").replace("Infinity", ".inf")
    assert parse_yaml(text).value == {"a": value}
