"""A short fuzzing of the commands and the wire; the long one is `make fuzz`."""

from __future__ import annotations

import time

import numpy as np

from railui.capture.protocol.link import Link
from tests.fuzz.__main__ import forged_streams, fuzz_commands
from tests.fuzz.mutations import mutate, mutate_words


def test_mutated_files_and_words_give_no_traceback_hang_or_warning() -> None:
    outcomes = fuzz_commands(seed=5, first=0, last=120)
    assert len(outcomes) == 120
    assert [o for o in outcomes if o["fault"]] == []
    assert {0, 2} <= {o["code"] for o in outcomes}


def test_mutations_are_repeatable() -> None:
    data, words = b"a: 1\nb: [2, 3]\n" * 9, ["check", "a.yaml", "--jobs", "2"]
    first, second = ([mutate(data, np.random.default_rng([1, k])) for k in range(50)] for _ in range(2))
    assert first == second and len(set(first)) > 40
    assert len({tuple(mutate_words(words, np.random.default_rng([2, k]))) for k in range(50)}) > 20


def test_forged_streams_raise_no_exception() -> None:
    assert forged_streams(3) == 0


def test_line_feeds_cost_little_time() -> None:
    link, start = Link(), time.process_time()
    for _ in range(20):
        link.feed(b"\n" * 1_000_000)
    assert time.process_time() - start < 10.0 and link.close().frames == 0
