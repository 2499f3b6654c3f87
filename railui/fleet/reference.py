"""Reference of a vehicle: the model calibrated on its first runs, about which every run is linearised."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.campaign import Campaign, RunEntry
from railui.campaign.dataset import Dataset
from railui.campaign.noise.estimate import estimate_noise_model
from railui.campaign.noise.model import white_noise
from railui.campaign.prior import with_prior
from railui.campaign.segment import Segment
from railui.fleet.fleet_file import Vehicle
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.noise_floor import noise_weights
from railui.identification.structure.candidates import Candidate, list_candidates
from railui.vehicle.model import Model
from railui.vehicle.track_geometry import track_geometry

MIDDLE: Final = 2  # shapes of a kind are ordered by size; the one in the middle is followed


@dataclass(frozen=True, eq=False)
class Reference:
    """Reference of a vehicle.

    Attributes
    ----------
    paths
        Parameters [p] that every run estimates.
    x, sd
        Their calibrated values and standard deviations [p].
    channels, weights
        Measured channels [c] and their weights, 1 / standard deviation of their noise.
    noise_columns, noise
        Noise level of columns.
    error_to_noise
        Error of the calibrated model on the first runs over the error that noise leaves.
    """

    paths: tuple[str, ...]
    x: FloatArray
    sd: FloatArray
    channels: tuple[str, ...]
    weights: FloatArray
    noise_columns: tuple[str, ...]
    noise: FloatArray
    error_to_noise: float

    def arrays(self) -> dict[str, Any]:
        """Return the fields as arrays, for the store."""
        return {f.name: np.asarray(getattr(self, f.name)) for f in fields(self)}

    @classmethod
    def of_arrays(cls, arrays: dict[str, Any]) -> Reference:
        """Return the reference of stored arrays."""
        names = ("paths", "channels", "noise_columns")
        read = {f.name: arrays[f.name] for f in fields(cls)}
        read |= {name: tuple(arrays[name].tolist()) for name in names}
        return cls(**read | {"error_to_noise": float(arrays["error_to_noise"])})

    @property
    def noise_levels(self) -> dict[str, float]:
        """Noise level by column."""
        return dict(zip(self.noise_columns, self.noise.tolist(), strict=True))


def campaign_of(vehicle: Vehicle) -> Campaign:
    """Return the campaign of a vehicle's type, from the calibrated vehicle of its loop where it has one."""
    campaign = vehicle.type.campaign
    return campaign if vehicle.prior is None else with_prior(campaign, vehicle.prior)


def make_reference(vehicle: Vehicle, segments: Sequence[Segment]) -> Reference:
    """Calibrate a vehicle on the comparable parts of its first runs.

    Raises
    ------
    ValueError
        Where the vehicle diverges.
    """
    campaign = campaign_of(vehicle)
    numbered = [replace(s, role="adjust", run_index=i, number=0) for i, s in enumerate(segments)]
    entries = tuple(RunEntry(campaign.directory / s.file, "adjust", s.file) for s in numbered)
    campaign = replace(campaign, runs=entries)
    noise = estimate_noise_model(
        numbered,
        campaign.noise,
        track_geometry(campaign.design),
        campaign.band,
        campaign.noise_band,
        campaign.settings.noise,
    )
    context = create_context(Dataset(campaign, (), tuple(numbered), noise), jobs=1)
    fit = calibrate(context)
    shared = [j for j, path in enumerate(fit.free.paths) if "@" not in path]
    weights = [noise_weights(context, fit.model, s) for s in numbered]
    names = sorted(noise)
    return Reference(
        tuple(fit.free.paths[j] for j in shared),
        fit.x[shared],
        fit.sd[shared],
        tuple(numbered[0].channels),
        np.asarray(1.0 / np.sqrt(np.mean([1.0 / w**2 for w in weights], axis=0))),
        tuple(names),
        np.array([noise[name] for name in names]),
        fit.error_to_noise,
    )


def reference_context(vehicle: Vehicle, reference: Reference, segment: Segment) -> tuple[Context, Model]:
    """Return the context of one run and the calibrated model of its vehicle."""
    campaign = campaign_of(vehicle)
    levels = reference.noise_levels
    entry = RunEntry(campaign.directory / segment.file, "adjust", segment.file)
    campaign = replace(campaign, runs=(entry,), noise=levels, prior=None)
    context = create_context(Dataset(campaign, (), (segment,), white_noise(levels)), jobs=1)
    return context, context.nominal.with_path_values(reference.paths, reference.x)


def watched_candidates(vehicle: Vehicle, segment: Segment) -> list[Candidate]:
    """List the effects of the watched kinds at every location, each with one shape, for all vehicles of a type.

    Their sizes refer to the motion of the nominal vehicle on one run, so that amounts of all vehicles are comparable.
    Effects with a phase are left out: their phase belongs to a run.
    """
    campaign = vehicle.type.campaign
    found = list_candidates(Model(campaign.design), [segment], loaded=campaign.track == "loaded")
    return [
        replace(c, shapes=(c.shapes[(len(c.shapes) - 1) // MIDDLE],))
        for c in found
        if not c.has_phase and {c.kind, f"{c.kind} at {c.at}"} & set(vehicle.type.watch)
    ]
