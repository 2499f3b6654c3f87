"""Information of a planned run: inner products of sensitivities and output differences, and their scores under noise.

Everything that a plan needs to know of a run for any set of its sensors, so that sets and runs are compared without
another simulation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.block_products import block_length, split_into_blocks
from railui.identification.estimation.fit import block_duration
from railui.identification.estimation.free_parameters import FreeParameters, free_parameters
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.problem import FitSegment, prepare_segments
from railui.identification.structure.candidates import Candidate, CandidateBatch, batch_candidates, list_candidates
from railui.identification.structure.score_test import output_differences
from railui.parallel import Pool, map_as_completed, map_threads
from railui.planning.noise_residuals import draw_noise_residuals
from railui.planning.run_information import RunInformation
from railui.planning.store import InformationStore, content_key
from railui.planning.validation_products import ValidationProducts, validation_products
from railui.vehicle.model import Model

NOISE_DRAWS = 16
NOISE_SEED = 19
Key = tuple[Candidate, int]  # candidate and number of its shape


@dataclass(frozen=True, eq=False)
class Information:
    """Information of several runs about the same parameters and candidates."""

    free: FreeParameters
    keys: tuple[Key, ...]
    runs: tuple[RunInformation, ...]
    _validation: dict[tuple[int, tuple[str, ...]], ValidationProducts] = field(default_factory=dict, repr=False)

    def validation_products(self, number: int, channels: tuple[str, ...]) -> ValidationProducts:
        """Return the products of some sensors of a run, computed once."""
        key = (number, channels)
        if key not in self._validation:
            self._validation[key] = validation_products(self.runs[number], channels, len(self.free.paths))
        return self._validation[key]


Result = tuple[RunInformation, NDArray[np.bool_]]  # of a run, and which shapes are valid


@dataclass(frozen=True, eq=False)
class RunJob:
    """Computation of the information of one run, which any process can do.

    Attributes
    ----------
    context
        Of all runs, or of this one.
    target
        The run, prepared for comparison.
    index
        Its number, which seeds its noise.
    candidates
        Effects that are compared.
    seconds
        Length of a block.
    """

    context: Context
    target: FitSegment
    index: int
    candidates: tuple[Candidate, ...]
    seconds: float


def collect_information(
    context: Context, store: InformationStore | None = None, cluster: Pool | None = None
) -> Information:
    """Linearise the nominal model on the estimation runs of a context and score noise on every row.

    Parameters
    ----------
    context
        Its estimation runs are the planned ones, simulated without noise.
    store
        Where the information of every run is kept; None: nowhere.
    cluster
        Where the runs are computed; None: here, side by side, one on each thread of the context.
    """
    model = context.nominal
    prepared = prepare_segments(context, model, context.dataset.estimation)
    free = free_parameters(context, model, context.campaign.estimated_parameters)
    segments = context.dataset.estimation
    candidates = list_candidates(model, segments, without=context.excluded, loaded=context.campaign.track == "loaded")
    keys = tuple((b.members[member], shape) for b in batch_candidates(candidates) for member, shape in b.lanes)
    # of every run alone: which others are chosen with it is not known yet
    seconds = [block_duration(context.settings.calibration, model, [target.segment]) for target in prepared]
    x = np.array([model.value(p) for p in free.paths])
    names = [(c.kind, c.at, c.wheelset, dict(c.shapes[shape])) for c, shape in keys]
    noise, band = dict(context.dataset.noise), context.campaign.noise_band
    test, step = context.settings.score_test, context.settings.calibration.damped_mode_step
    constant = (free.paths, x, names, test, step, noise, band, context.seed)
    names_of_runs = [
        content_key((*constant, i, block_length(seconds[i], target), *_content_of(target)))
        for i, target in enumerate(prepared)
    ]
    found = {i: result for i, name in enumerate(names_of_runs) if store and (result := store.read(name)) is not None}
    open_jobs = [
        RunJob(context, target, i, tuple(candidates), seconds[i]) for i, target in enumerate(prepared) if i not in found
    ]
    for number, result in _results(open_jobs, len(free.paths), len(keys), cluster):
        job = open_jobs[number]
        found[job.index] = result
        if store is not None:
            store.write(names_of_runs[job.index], *result)
    is_valid = np.logical_and.reduce([valid for _, valid in found.values()])
    kept = np.flatnonzero(is_valid).astype(np.int64)
    runs = tuple(_select(found[i][0], len(free.paths), kept) for i in range(len(prepared)))
    return Information(free, tuple(keys[k] for k in kept), runs)


def _results(
    jobs: Sequence[RunJob], parameters: int, shapes: int, cluster: Pool | None
) -> Iterator[tuple[int, Result]]:
    """Yield the number of a job and its result, each as soon as it is there."""
    if not jobs:
        return
    context = jobs[0].context
    place = "" if cluster is None else " on the cluster"
    context.progress.message(f"{len(jobs)} runs{place}: {parameters} parameters, {shapes} shapes of effects")
    if len(jobs) == 1 and cluster is None:
        yield 0, run_information(jobs[0])
        return
    alone = [_remote(job) for job in jobs]
    results = (
        map_as_completed(run_information, alone, context.jobs)
        if cluster is None
        else cluster.map(run_information, alone)
    )
    for done, (number, result) in enumerate(results, 1):
        context.progress.message(f"{done} of {len(jobs)} runs: {jobs[number].target.segment.file}")
        yield number, result


def _remote(job: RunJob) -> RunJob:
    """Return a job with what its run needs only, for one thread."""
    segment, context = replace(job.target.segment, tables={}), job.context.in_background(1)
    dataset = replace(context.dataset, segments=(segment,))
    return replace(job, target=replace(job.target, segment=segment), context=replace(context, dataset=dataset))


def run_information(job: RunJob) -> Result:
    """Linearise the nominal model on a run; the result does not depend on the other runs, nor on the process."""
    context, target = job.context, job.target
    model = context.nominal
    free = free_parameters(context, model, context.campaign.estimated_parameters)
    solver = GaussNewton(context, model, free, [target])
    x = np.array([model.value(p) for p in free.paths])
    sensitivities, _ = solver.sensitivities(target, x)
    differences, valid = _differences(context, model, target, batch_candidates(job.candidates))
    rows = np.concatenate([sensitivities[1:], differences])
    noise = _noise_realisations(context, model, target, job.index)
    return _products(target, rows, noise, block_length(job.seconds, target)), valid


def _content_of(target: FitSegment) -> list[object]:
    """List what the information of a segment depends on."""
    columns = [part for name in sorted(target.segment.columns) for part in (name, target.segment.columns[name])]
    steps = (target.steps, target.sensitivity_steps)
    return [*columns, target.filter.weights, target.filter.sos, target.filter.trim, target.measured, *steps]


def _differences(
    context: Context, model: Model, target: FitSegment, batches: Sequence[CandidateBatch]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Output differences per amount [k, channel, n] of all shapes, and which are valid [k]."""

    def differences(batch: CandidateBatch) -> tuple[FloatArray, NDArray[np.bool_]]:
        return output_differences(context.settings, model, target, batch)

    parts = list(map_threads(differences, batches, context.jobs))
    return np.concatenate([x for x, _ in parts]), np.concatenate([valid for _, valid in parts])


def _noise_realisations(context: Context, model: Model, target: FitSegment, index: int) -> FloatArray:
    """Draw residuals [draw, channel, n] of the true model: noise of the sensors, and of the track through the model."""
    predictor = target.predictor(model)
    clean, _ = predictor.simulate()
    seeds = [(context.seed, NOISE_SEED, index, k) for k in range(NOISE_DRAWS)]
    return draw_noise_residuals(context, predictor, clean[0], target.filter_and_weight, seeds)


def _products(target: FitSegment, rows: FloatArray, noise: FloatArray, length: int) -> RunInformation:
    """Inner products of rows [row, channel, n] in all, with noise [draw, channel, n], and per block."""
    by_channel = rows.transpose(1, 0, 2)
    in_blocks = split_into_blocks(rows, length)  # [row, channel, block, sample]
    noisy = split_into_blocks(noise, length)
    scores = np.einsum("rcbn,dcbn->dbcr", in_blocks, noisy, optimize=True)
    return RunInformation(
        tuple(target.segment.channels),
        gram=by_channel @ by_channel.transpose(0, 2, 1),
        noise_scores=scores.reshape(-1, *scores.shape[2:]),
        block_norms=np.einsum("rcbn,rcbn->bcr", in_blocks, in_blocks),
        signal=np.sum(target.measured**2, axis=1),
        noise=np.mean(np.sum(noise**2, axis=2), axis=0),
        samples=target.measured.shape[1],
    )


def _select(run: RunInformation, parameters: int, kept: NDArray[np.int64]) -> RunInformation:
    """Keep the parameters and the valid shapes."""
    rows = np.concatenate([np.arange(parameters), parameters + kept])
    return RunInformation(
        run.channels,
        run.gram[:, rows][:, :, rows],
        run.noise_scores[:, :, rows],
        run.block_norms[:, :, rows],
        run.signal,
        run.noise,
        run.samples,
    )
