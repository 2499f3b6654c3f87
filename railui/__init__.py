"""railui: railway bogie models calibrated against measurements, unmodelled effects, suspension design."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from railui._version import __version__
    from railui.api.assessed_track import Assessment
    from railui.api.assessment import assess_en14363
    from railui.api.bundled import bundled
    from railui.api.campaign import Campaign
    from railui.api.contact import analyse_contact, analyse_radius_table, linearise_profiles
    from railui.api.curving import Curve
    from railui.api.design import Design
    from railui.api.files import check, diff, schema
    from railui.api.fit import Fit, adjust
    from railui.api.fleet import fleet_block_means, fleet_status, update_fleet
    from railui.api.fmu import export_fmu, fmu_inputs
    from railui.api.library import effects
    from railui.api.loading import load
    from railui.api.loop import Loop, loop
    from railui.api.machine import benchmark, self_test
    from railui.api.optimisation import Optimisation
    from railui.api.plan import Plan, plan
    from railui.api.planning import next_runs
    from railui.api.recordings import decode_recording, import_recording, record
    from railui.api.residual import Residual
    from railui.api.response import Response, export_state_space
    from railui.api.response_map import ResponseMap, response_map
    from railui.api.ride import Ride
    from railui.api.ride_cases import ride_cases
    from railui.api.run import Run
    from railui.api.sensitivity import Sensitivity, sensitivity
    from railui.api.series import Series
    from railui.api.stability import Stability
    from railui.api.study import Study
    from railui.api.track import Track, analyse_track
    from railui.curving import curve, curves
    from railui.desk.opening import open_desk
    from railui.execution.session import status
    from railui.io.problems import FileProblems, Problem
    from railui.optimisation.optimise import optimise
    from railui.ride_quality.evaluation import ride, ride_many, simulate
    from railui.ride_quality.linear_response import response
    from railui.ride_quality.track_assessment import assess
    from railui.running_stability.summary import stability
    from railui.track import synthetic_track

__all__ = [
    "Assessment",
    "Campaign",
    "Curve",
    "Design",
    "FileProblems",
    "Fit",
    "Loop",
    "Optimisation",
    "Plan",
    "Problem",
    "Residual",
    "Response",
    "ResponseMap",
    "Ride",
    "Run",
    "Sensitivity",
    "Series",
    "Stability",
    "Study",
    "Track",
    "__version__",
    "adjust",
    "analyse_contact",
    "analyse_radius_table",
    "analyse_track",
    "assess",
    "assess_en14363",
    "benchmark",
    "bundled",
    "check",
    "curve",
    "curves",
    "decode_recording",
    "diff",
    "effects",
    "export_fmu",
    "export_state_space",
    "fleet_block_means",
    "fleet_status",
    "fmu_inputs",
    "import_recording",
    "linearise_profiles",
    "load",
    "loop",
    "next_runs",
    "open_desk",
    "optimise",
    "plan",
    "record",
    "response",
    "response_map",
    "ride",
    "ride_cases",
    "ride_many",
    "schema",
    "self_test",
    "sensitivity",
    "simulate",
    "stability",
    "status",
    "synthetic_track",
    "update_fleet",
]

# module of each public name, imported on first access so that `import railui` is quick
_MODULES = {
    "__version__": "railui._version",
    "Assessment": "railui.api.assessed_track",
    "Campaign": "railui.api.campaign",
    "Curve": "railui.api.curving",
    "Design": "railui.api.design",
    "FileProblems": "railui.io.problems",
    "Fit": "railui.api.fit",
    "Loop": "railui.api.loop",
    "Optimisation": "railui.api.optimisation",
    "Plan": "railui.api.plan",
    "Problem": "railui.io.problems",
    "Residual": "railui.api.residual",
    "Response": "railui.api.response",
    "ResponseMap": "railui.api.response_map",
    "Ride": "railui.api.ride",
    "Run": "railui.api.run",
    "Sensitivity": "railui.api.sensitivity",
    "Series": "railui.api.series",
    "Stability": "railui.api.stability",
    "Study": "railui.api.study",
    "Track": "railui.api.track",
    "adjust": "railui.api.fit",
    "analyse_contact": "railui.api.contact",
    "analyse_radius_table": "railui.api.contact",
    "analyse_track": "railui.api.track",
    "assess": "railui.ride_quality.track_assessment",
    "assess_en14363": "railui.api.assessment",
    "benchmark": "railui.api.machine",
    "bundled": "railui.api.bundled",
    "check": "railui.api.files",
    "curve": "railui.curving",
    "curves": "railui.curving",
    "decode_recording": "railui.api.recordings",
    "diff": "railui.api.files",
    "effects": "railui.api.library",
    "export_fmu": "railui.api.fmu",
    "export_state_space": "railui.api.response",
    "fleet_block_means": "railui.api.fleet",
    "fleet_status": "railui.api.fleet",
    "fmu_inputs": "railui.api.fmu",
    "import_recording": "railui.api.recordings",
    "linearise_profiles": "railui.api.contact",
    "load": "railui.api.loading",
    "loop": "railui.api.loop",
    "next_runs": "railui.api.planning",
    "open_desk": "railui.desk.opening",
    "optimise": "railui.optimisation.optimise",
    "plan": "railui.api.plan",
    "record": "railui.api.recordings",
    "response": "railui.ride_quality.linear_response",
    "response_map": "railui.api.response_map",
    "ride": "railui.ride_quality.evaluation",
    "ride_cases": "railui.api.ride_cases",
    "ride_many": "railui.ride_quality.evaluation",
    "schema": "railui.api.files",
    "self_test": "railui.api.machine",
    "sensitivity": "railui.api.sensitivity",
    "simulate": "railui.ride_quality.evaluation",
    "stability": "railui.running_stability.summary",
    "status": "railui.execution.session",
    "synthetic_track": "railui.track",
    "update_fleet": "railui.api.fleet",
}


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        from importlib import import_module

        return getattr(import_module(_MODULES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_MODULES])
