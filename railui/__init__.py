"""railui: railway bogie models calibrated against measurements, unmodelled effects, suspension design."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from railui._version import __version__
    from railui.curving import curve
    from railui.documents.check import LoadedFile
    from railui.optimisation.optimise import optimise
    from railui.report.loop.data import loop
    from railui.ride_quality.evaluation import ride, ride_many, simulate
    from railui.ride_quality.linear_response import response
    from railui.ride_quality.track_assessment import assess
    from railui.running_stability.summary import stability
    from railui.track import synthetic_track

__all__ = [
    "__version__",
    "assess",
    "curve",
    "load",
    "loop",
    "optimise",
    "response",
    "ride",
    "ride_many",
    "simulate",
    "stability",
    "synthetic_track",
]

# module of each public name, imported on first access so that `import railui` is quick
_MODULES = {
    "__version__": "railui._version",
    "assess": "railui.ride_quality.track_assessment",
    "curve": "railui.curving",
    "loop": "railui.report.loop.data",
    "optimise": "railui.optimisation.optimise",
    "response": "railui.ride_quality.linear_response",
    "ride": "railui.ride_quality.evaluation",
    "ride_many": "railui.ride_quality.evaluation",
    "simulate": "railui.ride_quality.evaluation",
    "stability": "railui.running_stability.summary",
    "synthetic_track": "railui.track",
}


def load(path: str) -> LoadedFile:
    """Load a file of any kind: a design, a campaign, a study, a run, a track or a profile.

    Raises
    ------
    FileProblems
        With every problem of the file.

    Examples
    --------
    >>> load("designs/test_bogie.yaml").value("contact.flange_clearance")
    0.007
    """
    from railui.documents.check import load as load_file
    from railui.track import parse_spec

    return load_file(path, check_track=parse_spec)


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        from importlib import import_module

        return getattr(import_module(_MODULES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_MODULES])
