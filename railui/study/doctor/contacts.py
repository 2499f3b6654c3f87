"""Published values of wheel and rail: Kalker's coefficients, equivalent conicity."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from railui.study.doctor.checks import Check

GROUPS: Final[tuple[Callable[[], Iterator[Check]], ...]] = ()
WITH_DATA: Final[dict[str, Callable[[Path], Iterator[Check]]]] = {}
