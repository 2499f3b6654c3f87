"""Random mutations of text files and words of command lines, from a seeded generator."""

from __future__ import annotations

import re

import numpy as np

NUMBER = re.compile(rb"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
NUMBERS = (
    b"0",
    b"-1",
    b"1e308",
    b"-1e308",
    b"1e-308",
    b"nan",
    b"inf",
    b"1000000000",
    b"1e9",
    b"-0.0",
    b"abc",
    b"",
    b"0,5",
)
PIECES = (
    b"\0",
    b"\xff\xfe",
    b"\r",
    b"\t",
    b'"',
    b"'",
    b"#",
    b"[",
    b"{",
    b"&a",
    b"*a",
    b"!!float nan",
    b",,",
    b";",
    b"\xc3",
)
Random = np.random.Generator


def mutate(data: bytes, random: Random) -> bytes:
    """Return the data with one to three mutations."""
    for _ in range(int(random.integers(1, 4))):
        data = MUTATIONS[int(random.integers(len(MUTATIONS)))](data, random)
    return data


def replace_number(data: bytes, random: Random) -> bytes:
    """Replace a number by an extreme one, or scale it."""
    found = list(NUMBER.finditer(data))
    if not found:
        return data
    match = found[int(random.integers(len(found)))]
    if random.random() < 0.4:
        new = b"%.9g" % (float(match[0]) * float(10.0 ** random.integers(-6, 7)))
    else:
        new = NUMBERS[int(random.integers(len(NUMBERS)))]
    return data[: match.start()] + new + data[match.end() :]


def change_bytes(data: bytes, random: Random) -> bytes:
    """Replace, insert or delete some bytes."""
    at = int(random.integers(len(data) + 1))
    piece = PIECES[int(random.integers(len(PIECES)))] if random.random() < 0.7 else random.bytes(3)
    return data[:at] + piece + data[at + int(random.integers(4)) :]


def change_lines(data: bytes, random: Random) -> bytes:
    """Delete, repeat or move a line."""
    lines = data.split(b"\n")
    at, kind = int(random.integers(len(lines))), int(random.integers(3))
    if kind == 0:
        del lines[at]
    else:
        line = lines[at] if kind == 1 else lines.pop(at)
        lines.insert(int(random.integers(len(lines) + 1)), line)
    return b"\n".join(lines)


def change_column(data: bytes, random: Random) -> bytes:
    """Set a column of a table to one number, or scale it."""
    lines = data.split(b"\n")
    column, factor = int(random.integers(8)), float(10.0 ** random.integers(-6, 7))
    constant = NUMBERS[int(random.integers(len(NUMBERS)))] if random.random() < 0.5 else None
    for i, line in enumerate(lines):
        cells = line.split(b",")
        if column < len(cells) > 1 and NUMBER.fullmatch(cells[column]):
            cells[column] = b"%.9g" % (float(cells[column]) * factor) if constant is None else constant
            lines[i] = b",".join(cells)
    return b"\n".join(lines)


def truncate(data: bytes, random: Random) -> bytes:
    """Cut the end off."""
    return data[: int(random.integers(len(data) + 1))]


MUTATIONS = (replace_number, replace_number, replace_number, change_bytes, change_lines, change_column, truncate)


def mutate_words(words: list[str], random: Random) -> list[str]:
    """Return the words of a command line with one of them changed, repeated or left out."""
    words = list(words) if len(words) > 1 else [*words, "1"]
    at = int(random.integers(1, len(words)))
    kind = int(random.integers(4))
    if kind == 0:
        del words[at]
    elif kind == 1:
        words.insert(at, words[int(random.integers(1, len(words)))])
    else:
        changed = replace_number(words[at].encode(), random) if kind == 2 else change_bytes(words[at].encode(), random)
        words[at] = changed.decode("utf-8", "replace").replace("\0", "")
    return words
