"""What the notes of a report say of a rest that has no shape."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from railui.report.loop import _shapeless
from railui.study.loop import Found


def found(unexplained: float, p: float, **more: Any) -> Found:
    last = SimpleNamespace(sightings=(1,), p=p, rho2=0.05)
    after = SimpleNamespace(channels={"e1": 0.05, "ayf": 0.13})
    floor = SimpleNamespace(channels={"e1": 0.05, "ayf": 0.10})
    found = SimpleNamespace(unexplained=unexplained, last=last, outside=None, judged={"after": after}, floor=floor)
    return cast(Found, SimpleNamespace(**(vars(found) | more)))


def test_a_rest_that_no_candidate_sees_is_put_down_to_forces_or_noise_and_its_channels_named():
    (note,) = _shapeless(found(1.2, p=0.5))
    assert note.startswith("1.20 times the floor is left") and "ayf 1.30, e1 1.00" in note


@pytest.mark.parametrize("other", [{"unexplained": 1.05}, {"p": 0.001}, {"outside": "a curve"}])
def test_a_rest_at_the_floor_or_with_a_shape_or_told_as_outside_has_no_such_note(other: dict[str, Any]):
    assert _shapeless(found(**({"unexplained": 1.2, "p": 0.5} | other))) == []
