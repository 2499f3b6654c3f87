"""Both standard jobs as plain arrays, a part of them for slow peers, and the results of the kernel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import sosfilt

from railui.bench.standard_job import bogie_model, spread_designs, standard_excitation
from railui.ride_quality.comfort import comfort_sections
from railui.ride_quality.score import score_many
from railui.ride_quality.statistics import BLOCK_DURATION, SCORE_CHANNELS
from railui.vehicle.design import RidingSettings
from tests.bench.peers.bogie import coefficients

Floats = NDArray[np.float64]
Answers = dict[str, Floats]


@dataclass(frozen=True)
class Job:
    """A job of some designs over some samples; peers read `c`, `track`, `dt`, and answer as `answers`."""

    full: bool
    rows: Floats  # [design, number] as the kernel takes them
    samples: int

    @property
    def name(self) -> str:
        return "full" if self.full else "reduced"

    def part(self, designs: int, samples: int) -> Job:
        """The first designs over the first samples, or more designs than the job has: the same ones again."""
        return replace(self, rows=np.resize(self.rows, (designs, self.rows.shape[1])), samples=samples)

    @cached_property
    def model(self) -> Any:
        return bogie_model(reduced=not self.full)

    @cached_property
    def way(self) -> Any:
        return standard_excitation(reduced=not self.full)

    @property
    def dt(self) -> float:
        return float(self.way.dt)

    @property
    def design_steps(self) -> int:
        return len(self.rows) * (self.samples - 1)

    @cached_property
    def parameters(self) -> dict[str, Floats]:
        return {path: self.rows[:, i] for path, i in self.model.columns.items()}

    @cached_property
    def c(self) -> Floats:
        """Coefficients [coefficient, design]."""
        return coefficients(self.parameters, self.way.speed, self.full)

    @cached_property
    def table(self) -> Floats:
        """The kernel's input table of half steps."""
        return np.ascontiguousarray(self.way.table(self.model.wheelset_spacing(), 1)[: 2 * self.samples - 1])

    @cached_property
    def track(self) -> Floats:
        """Rows of half steps: line y_w + r phi_w, phi_w, dy_w/ds, dphi_w/ds of each wheelset."""
        r = self.model.design.value("vehicle.geometry.rolling_radius")
        each = [self.table[:, i : i + 4] for i in (2, 7)]
        return np.ascontiguousarray(np.hstack([np.stack([t[:, 0] + r * t[:, 2], *t[:, [2, 1, 3]].T], 1) for t in each]))

    @cached_property
    def named_sections(self) -> dict[str, Floats]:
        """The weightings of comfort [section, 6] by the name of the statistic; none in the reduced job."""
        made = comfort_sections(self.model, self.rows[:1], self.dt) if self.full else {}
        return {name: each[0] for name, each in made.items()}

    @property
    def riding(self) -> RidingSettings:
        return self.model.design.riding

    @cached_property
    def clearance(self) -> float:
        return float(self.model.design.value("contact.flange_clearance"))

    def kernel(self) -> Callable[[], Answers]:
        """railui itself on one thread."""
        vehicles, batch = self.model.vehicles(), self.model.batch(self.rows)
        clearance = np.full(len(self.rows), self.clearance)
        cascades = [
            np.ascontiguousarray(np.broadcast_to(s, (len(self.rows), *s.shape))) for s in self.named_sections.values()
        ]
        block = round(BLOCK_DURATION / self.dt) if self.full else 0

        def run() -> Answers:
            channels = SCORE_CHANNELS if self.full else SCORE_CHANNELS[:1]
            result = vehicles.ride_statistics(
                batch, self.table, self.dt, 1, channels, clearance, cascades, block=block, jobs=1
            )
            return self.answers(result.displacement, result.rms[:, 0].T if self.full else None)

        return run

    def answers(self, displacement: Floats, rms: Floats | None) -> Answers:
        """From mean, sd and share of contact of e_1 (and e_2) [design, wheelset, 3] and the rms per weighting."""
        e = np.asarray(displacement)
        result = {f"rms e_{i + 1}": np.hypot(e[:, i, 0], e[:, i, 1]) for i in range(e.shape[1])}
        if rms is None:
            return result
        statistics: dict[str, Any] = dict(zip(self.named_sections, np.asarray(rms), strict=True))
        result |= statistics
        statistics |= {"mean_e": e[..., 0], "sd_e": e[..., 1], "flange_fractions": e[..., 2]}
        return result | {"score": score_many(statistics, self.riding, self.clearance)["score"]}

    def of_sums(self, sums: Floats, squares: Floats, touching: Floats, weighted: Floats | None) -> Answers:
        """From sums over the samples: of e, e^2 and contact [wheelset, design], of squares [weighting, design]."""
        mean = sums / self.samples
        sd = np.sqrt(np.maximum(squares / self.samples - mean**2, 0.0))
        rms = None if weighted is None else np.sqrt(weighted / self.samples)
        return self.answers(np.stack([mean, sd, touching / self.samples], axis=-1).transpose(1, 0, 2), rms)

    def of_series(self, e: Floats, acceleration: Floats) -> Answers:
        """From series: e [wheelset, design, sample] and the frame's acceleration [design, sample]."""
        e = e if self.full else e[:1]
        displacement = np.stack([e.mean(axis=-1), e.std(axis=-1), (abs(e) >= self.clearance).mean(axis=-1)], axis=-1)
        weighted = [sosfilt(one, acceleration) for one in self.named_sections.values()]
        rms = np.sqrt(np.mean(np.square(weighted), axis=-1)) if self.full else None
        return self.answers(displacement.transpose(1, 0, 2), rms)


def jobs() -> list[Job]:
    """The full and the reduced job, as `railui bench` runs them."""
    return [Job(full, spread_designs(bogie_model(reduced=not full)), 20_000) for full in (True, False)]


def difference(found: Answers, wanted: Answers) -> float:
    """The largest relative difference of any answer of any design."""
    assert found.keys() == wanted.keys()
    return max(float(np.max(abs(np.asarray(found[key]) - wanted[key]) / abs(wanted[key]))) for key in wanted)
