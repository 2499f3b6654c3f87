"""Engine of a fleet: references and summaries of all runs that are not stored yet, on threads or a cluster."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

import railui
from railui import core
from railui.campaign.dataset import segments_of_run
from railui.campaign.settings.fleet import FleetSettings
from railui.fleet.fleet_file import Fleet, Vehicle, VehicleType
from railui.fleet.quick_path import Watch, summarise_run
from railui.fleet.reference import Reference, make_reference, watched_candidates
from railui.fleet.run_list import FleetRun, list_runs, local_file
from railui.fleet.schema import TriggersModel
from railui.fleet.store import FleetStore, pack
from railui.fleet.triggers import Part, comparable_part
from railui.identification.structure.candidates import Candidate
from railui.io.atomic import canonical_json, sha256, sha256_file
from railui.io.problems import FileProblems
from railui.parallel import Pool
from railui.progress import SILENT, Progress
from railui.runs.run import load_run

FORMAT: Final = 1  # of the summaries
SUMMARISED, WAITING = "summarised", "waiting"
RUN_SETTINGS: Final = ("run_prior_share",)  # of which the summary of a run depends


@dataclass(frozen=True)
class Update:
    """Counts of an update of the store.

    Attributes
    ----------
    runs
        Runs of the fleet.
    computed
        Summaries computed now.
    stored
        Runs whose summary, or the reason against one, was stored already.
    left_out
        Reason by the file of a run that has no summary.
    waiting
        Number of runs by vehicle without a reference yet.
    """

    runs: int
    computed: int
    stored: int
    left_out: dict[str, str]
    waiting: dict[str, int]


@dataclass(frozen=True)
class RunTask:
    """Everything that the summary of one run needs; sent to a worker as it is."""

    file: str
    section: str
    vehicle: Vehicle
    reference: Reference
    watch: Watch
    settings: FleetSettings
    triggers: TriggersModel


def read_part(file: str, vehicle_type: VehicleType, triggers: TriggersModel, section: str = "") -> Part | None:
    """Read the comparable part of a run; FileProblems for a run that cannot be used."""
    form = vehicle_type.campaign.design.run_form
    with local_file(file) as path:
        run = load_run(path, form)
    return comparable_part(segments_of_run(run, Path(file).name, "adjust", form), triggers, section)


def summarise_file(task: RunTask) -> dict[str, Any]:
    """Return the summary of a run as arrays, or the reason why it has none as `reason`."""
    try:
        part = read_part(task.file, task.vehicle.type, task.triggers, task.section)
        if part is None:
            return {"reason": "no part fulfils the triggers"}
        summary = summarise_run(task.vehicle, task.reference, task.watch, task.settings, part.segment)
    except FileProblems as error:
        return {"reason": str(error.problems[0])}
    except (ValueError, ArithmeticError, np.linalg.LinAlgError, OSError) as error:
        return {"reason": f"{type(error).__name__}: {error}"}
    return replace(summary, section=part.section).arrays()


def update_fleet(
    fleet: Fleet,
    store: FleetStore,
    pool: Pool,
    progress: Progress = SILENT,
    runs: Sequence[FleetRun] | None = None,
) -> Update:
    """Compute references and summaries of all runs that are not stored, and store each as it arrives.

    Results do not depend on the number of workers: a run depends on its file and on the reference of its vehicle alone.
    runs: where they have been listed already.
    """
    runs = list_runs(fleet) if runs is None else runs
    progress.message(f"{len(runs)} runs of {len(fleet.vehicles)} vehicles")
    hashes, unreadable = _file_hashes(store, runs)
    by_vehicle: dict[str, list[FleetRun]] = {name: [] for name in fleet.vehicles}
    for run in runs:
        by_vehicle[run.vehicle].append(run)
    watches = {name: _watch(fleet, store, t, runs) for name, t in fleet.types.items()}
    references, failures = _references(fleet, store, pool, by_vehicle, progress)
    keys = {}
    for run in runs:
        watch = watches[fleet.vehicles[run.vehicle].type.name]
        if run.vehicle in references and watch is not None and run.file in hashes:
            keys[run.file] = _summary_key(fleet, references[run.vehicle], watch, hashes[run.file], run)
    present = store.keys("summary") | store.keys("left out")
    keys = {file: key for file, key in keys.items() if file not in unreadable or key in present}
    missing = [run for run in runs if run.file in keys and keys[run.file] not in present]
    _compute(fleet, store, pool, missing, keys, references, watches, progress)
    return _record_runs(fleet, store, runs, keys, failures, unreadable, len(missing))


def _compute(
    fleet: Fleet,
    store: FleetStore,
    pool: Pool,
    missing: Sequence[FleetRun],
    keys: dict[str, str],
    references: dict[str, Reference],
    watches: dict[str, Watch | None],
    progress: Progress,
) -> None:
    tasks = []
    for run in missing:
        vehicle = fleet.vehicles[run.vehicle]
        watch = watches[vehicle.type.name]
        assert watch is not None
        tasks.append(
            RunTask(run.file, run.section, vehicle, references[run.vehicle], watch, fleet.settings, fleet.triggers)
        )
    for done, (number, arrays) in enumerate(pool.map(summarise_file, tasks), 1):
        run = missing[number]
        kind = "left out" if "reason" in arrays else "summary"
        store.write(keys[run.file], kind, run.vehicle, arrays)
        progress.message(f"{done} of {len(missing)} new runs")


def _record_runs(
    fleet: Fleet,
    store: FleetStore,
    runs: Sequence[FleetRun],
    keys: dict[str, str],
    failures: dict[str, str],
    unreadable: dict[str, str],
    computed: int,
) -> Update:
    """Write the table of runs and count them.

    failures: reason by vehicle without a reference. unreadable: reason by file.
    """
    left_out: dict[str, str] = {}
    waiting: dict[str, int] = {}
    rows = []
    summaries = store.keys("summary")
    for run in runs:
        key = keys.get(run.file, "")
        state = SUMMARISED if key in summaries else WAITING
        if key and state == WAITING:
            arrays = store.read(key)
            state = f"left out: {arrays['reason']}" if arrays is not None else WAITING
        if not key and run.vehicle in failures:
            state = f"left out: {failures[run.vehicle]}"
        if not key and run.file in unreadable:
            state = f"left out: {unreadable[run.file]}"
        if state == WAITING:
            waiting[run.vehicle] = waiting.get(run.vehicle, 0) + 1
        elif state != SUMMARISED:
            left_out[run.file] = state.partition(": ")[2]
        numbers = [None if np.isnan(x) else x for x in (run.mileage, run.load, run.temperature)]
        rows.append(
            (run.file, run.vehicle, fleet.vehicles[run.vehicle].type.name, run.time, *numbers, run.section, key, state)
        )
    store.replace_runs(rows)
    return Update(len(runs), computed, sum(bool(row[-2]) for row in rows) - computed, left_out, waiting)


def _file_hashes(store: FleetStore, runs: Sequence[FleetRun]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the hashes by file, and the reasons by file why some cannot be read.

    A file that can no longer be read has its last hash, with which its stored summary is found.
    """
    hashes, unreadable = {}, {}
    for run in runs:
        try:
            hashes[run.file] = _file_hash(store, run.file)
        except OSError as error:
            unreadable[run.file] = f"cannot be read: {error.strerror or type(error).__name__}"
            last = store.last_file_hash(Path(run.file))
            if last is not None:
                hashes[run.file] = last
    return hashes, unreadable


def _file_hash(store: FleetStore, file: str) -> str:
    """Hash of the contents of a file; of a remote one that of its address, size and version."""
    if "://" not in file:
        return store.file_hash(Path(file))
    from railui.fleet.run_list import file_version

    return sha256(f"{file} {file_version(file)}")


def content_key(*parts: object) -> str:
    """Return the hash of what a result depends on, of the version and of the kernel."""
    return sha256(canonical_json([FORMAT, railui.__version__, core.source_hash(), *parts]))


def _triggers_content(fleet: Fleet) -> object:
    return fleet.triggers.model_dump(mode="json")


def _watch(fleet: Fleet, store: FleetStore, vehicle_type: VehicleType, runs: Sequence[FleetRun]) -> Watch | None:
    """Effects that are followed on all vehicles of a type, from its first comparable run on; None: there is none."""
    key = _watch_key(fleet, vehicle_type)
    stored = _stored_watch(store, key)
    if stored is not None:
        return stored
    for run in runs:
        vehicle = fleet.vehicles[run.vehicle]
        if vehicle.type is not vehicle_type:
            continue
        try:
            part = read_part(run.file, vehicle_type, fleet.triggers, run.section)
        except (FileProblems, OSError):
            continue
        if part is not None:
            found = watched_candidates(vehicle, part.segment)
            records = [{"kind": c.kind, "at": c.at, "wheelset": c.wheelset, "shape": dict(c.shapes[0])} for c in found]
            store.write(key, "watch", vehicle_type.name, {"candidates": json.dumps(records), "source": run.file})
            return Watch(tuple(found))
    return None


def _watch_key(fleet: Fleet, vehicle_type: VehicleType) -> str:
    return content_key("watch", vehicle_type.content, _triggers_content(fleet))


def _stored_watch(store: FleetStore, key: str) -> Watch | None:
    stored = store.read(key)
    if stored is None:
        return None
    return Watch(tuple(_candidate(record) for record in json.loads(str(stored["candidates"]))))


def summarised_files(fleet: Fleet, store: FleetStore, runs: Sequence[FleetRun]) -> set[str]:
    """Return the files of which a summary is stored that the next update uses as it is; no file is read.

    These files have not changed since they were summarised, or can no longer be read.
    """
    watches = {name: _stored_watch(store, _watch_key(fleet, t)) for name, t in fleet.types.items()}
    stored = {name: store.read(reference_key(fleet, vehicle)) for name, vehicle in fleet.vehicles.items()}
    references = {name: Reference.of_arrays(arrays) for name, arrays in stored.items() if arrays is not None}
    present = store.keys("summary")
    files = set()
    for run in runs:
        watch = watches[fleet.vehicles[run.vehicle].type.name]
        file_hash = store.stored_file_hash(Path(run.file))
        if watch is None or file_hash is None or run.vehicle not in references:
            continue
        if _summary_key(fleet, references[run.vehicle], watch, file_hash, run) in present:
            files.add(run.file)
    return files


def _candidate(record: dict[str, Any]) -> Candidate:
    return Candidate(record["kind"], record["at"], record["wheelset"], (record["shape"],))


def reference_key(fleet: Fleet, vehicle: Vehicle) -> str:
    """Return the hash under which the reference of a vehicle is stored: made once, from its first runs."""
    prior = None if vehicle.prior is None else sha256_file(vehicle.prior / "adjusted.yaml")
    count = fleet.settings.reference_runs
    return content_key("reference", vehicle.type.content, _triggers_content(fleet), vehicle.name, prior, count)


def _references(
    fleet: Fleet, store: FleetStore, pool: Pool, by_vehicle: dict[str, list[FleetRun]], progress: Progress
) -> tuple[dict[str, Reference], dict[str, str]]:
    """Return the references by vehicle, and the reasons why vehicles have none."""
    references, failures, missing = {}, {}, []
    for name, vehicle in fleet.vehicles.items():
        stored = store.read(reference_key(fleet, vehicle))
        if stored is not None:
            references[name] = Reference.of_arrays(stored)
        elif by_vehicle[name]:
            missing.append(name)
    tasks = [
        (fleet.vehicles[name], by_vehicle[name], fleet.triggers, fleet.settings.reference_runs) for name in missing
    ]
    for number, arrays in pool.map(reference_of_files, tasks):
        name = missing[number]
        if arrays is None:
            continue
        if "reason" in arrays:
            failures[name] = f"no reference of {name}: {arrays['reason']}"
            progress.message(failures[name])
            continue
        store.write(reference_key(fleet, fleet.vehicles[name]), "reference", name, arrays)
        references[name] = Reference.of_arrays(arrays)
        progress.message(f"{name}: calibrated on its first {fleet.settings.reference_runs} runs")
    return references, failures


def reference_of_files(task: tuple[Vehicle, Sequence[FleetRun], TriggersModel, int]) -> dict[str, Any] | None:
    """Calibrate a vehicle on its first comparable runs; a `reason` why not, None while there are too few runs."""
    vehicle, runs, triggers, count = task
    parts, reason = [], "no part fulfils the triggers"
    for run in runs:
        try:
            part = read_part(run.file, vehicle.type, triggers, run.section)
        except FileProblems as error:
            reason = str(error.problems[0])
            continue
        except OSError as error:
            reason = f"{type(error).__name__}: {error}"
            continue
        if part is not None:
            parts.append(part.segment)
        if len(parts) == count:
            break
    if len(parts) < count:
        few = f"{len(parts)} of {len(runs)} runs can be used, {count} are needed; {reason}"
        return None if len(runs) < count else {"reason": few}
    try:
        return make_reference(vehicle, parts).arrays()
    except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
        return {"reason": f"{type(error).__name__}: {error}"}


def _summary_key(fleet: Fleet, reference: Reference, watch: Watch, file_hash: str, run: FleetRun) -> str:
    settings = {name: getattr(fleet.settings, name) for name in RUN_SETTINGS}
    followed = [[*watch.names], [dict(c.shapes[0]) for c in watch.candidates]]
    basis = sha256(pack(reference.arrays()))
    vehicle = fleet.vehicles[run.vehicle]
    parts = (vehicle.type.content, _triggers_content(fleet), run.section, basis, followed, settings, file_hash)
    return content_key("summary", *parts)
