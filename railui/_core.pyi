"""The compiled kernel as Python sees it; only railui.core imports it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

LANES: int
LINKAGE: int

Floats = NDArray[np.float64]

def catalogue() -> list[dict[str, Any]]: ...
def parameters(kind: str) -> list[str]: ...
def creep_forces(
    kind: str,
    numbers: list[float],
    wheel_load: float,
    creep_slopes: list[float],
    linear: list[list[float]],
    speed: float,
) -> list[list[float]]: ...
def passed(sections: Floats, memory: Floats, series: Floats) -> Floats: ...
def simd() -> str: ...
def chains(roots: bool, rounds: int) -> int: ...
def sources() -> str: ...

class Spline:
    def __init__(self, x: Floats, y: Floats) -> None: ...
    def at(self, places: Floats, derivative: int) -> Floats: ...
    def factors(self) -> Floats: ...

class Vehicle:
    def __init__(
        self,
        kind: str,
        placed: list[tuple[str, str, int, int, str | None]],
        measured: list[str],
        layout: Any = None,
        rig_input: str | None = None,
    ) -> None: ...
    def simulate(
        self,
        batch: Any,
        table: Floats,
        dt: float,
        steps: int,
        channels: list[str],
        filter_parts: tuple[Floats, Floats, int, int, Floats, int] | None = None,
        jobs: int = 1,
    ) -> tuple[Floats, list[int]]: ...
    def score(
        self,
        batch: Any,
        table: Floats,
        dt: float,
        steps: int,
        channels: list[str],
        clearance: Floats,
        cascades: list[Floats],
        block: int,
        jobs: int = 1,
        wheelsets: int = 2,
    ) -> tuple[Floats, Floats, Floats, list[int]]: ...
    def arithmetic(
        self,
        batch: Any,
        table: Floats,
        dt: float,
        channels: list[str],
        clearance: Floats,
        cascades: list[Floats],
        block: int,
        wheelsets: int,
    ) -> list[int] | None: ...
    def steps(self, batch: Any, slowest: float, fastest: float, dt: float, limit: int) -> list[int]: ...
    def eigenvalues(self, batch: Any, speed: float) -> list[list[tuple[float, float]]]: ...
    def sites(self, batch: Any) -> dict[tuple[str, int], tuple[float, float]]: ...
    def state_matrix(self, batch: Any, speed: float) -> Floats: ...
    def rates(self, batch: Any, row: Floats, states: Floats) -> Floats: ...
    def freedoms(self, batch: Any) -> list[str]: ...
    def statics(self, batch: Any, offsets: Floats, curvature: Floats) -> tuple[Floats, Floats]: ...
    def bodies(self, batch: Any) -> list[tuple[str, float]]: ...
    def channels(self, batch: Any) -> list[str]: ...
    def states(self, batch: Any) -> int: ...
