"""Intermediate results that a `Progress` receives from a loop and from a search."""

from railui.identification.estimation.noise_floor import NoiseFloor as NoiseFloor
from railui.identification.events import FitIteration as FitIteration
from railui.identification.events import ModelValidated as ModelValidated
from railui.identification.events import ScoreTestProgress as ScoreTestProgress
from railui.identification.structure.refit import Refit as Refit
from railui.identification.structure.score_result import ScoreResult as ScoreResult
from railui.identification.structure.score_test import ScoreTestResult as ScoreTestResult
from railui.optimisation.search import SearchState as SearchState
