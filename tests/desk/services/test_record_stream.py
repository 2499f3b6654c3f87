"""Records between processes: what is written comes back, and reading calls no function."""

from __future__ import annotations

import io
import os
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.desk.services.record_stream import RecordReader, RecordWriter
from railui.identification.verdict import Verdict


def read_back(obj: Any) -> Any:
    stream = io.BytesIO()
    RecordWriter(stream, protocol=pickle.HIGHEST_PROTOCOL).dump(obj)
    stream.seek(0)
    return RecordReader(stream).load()


@pytest.mark.parametrize("verdict", Verdict)
def test_a_verdict_comes_back_with_every_python(verdict: Verdict, monkeypatch: pytest.MonkeyPatch) -> None:
    """The members of an enumeration reduce to a call of getattr in Python 3.11.0 to 3.11.3."""
    monkeypatch.setattr(Verdict, "__reduce_ex__", lambda self, _: (getattr, (type(self), self.name)))
    assert read_back({"verdict": verdict})["verdict"] is verdict


def test_arrays_paths_and_slices_come_back() -> None:
    array, path, part = read_back((np.arange(3.0), Path("runs"), slice(1, 2)))
    assert np.array_equal(array, [0.0, 1.0, 2.0]) and path == Path("runs") and part == slice(1, 2)


class Call:
    def __reduce__(self) -> Any:
        return os.getenv, ("HOME",)


def test_a_call_is_refused() -> None:
    with pytest.raises(pickle.UnpicklingError, match=r"os\.getenv is not a record of railui"):
        read_back(Call())
