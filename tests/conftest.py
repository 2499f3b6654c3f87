"""Settings of all tests: SIGINT enabled, examples of hypothesis drawn alike, garbage collected after the tests are.

RAILUI_HYPOTHESIS=random draws other examples in every run, as `make fuzz` does.
"""

import gc
import os
import signal

import pytest
from hypothesis import settings

from railui.__main__ import GC_THRESHOLD
from tests.file_fixtures import *  # noqa: F403

# a shell without a terminal starts background processes with SIGINT ignored, which tested commands would inherit
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("alike", derandomize=True, deadline=None)
settings.register_profile("random", derandomize=False, deadline=None)
settings.load_profile(os.environ.get("RAILUI_HYPOTHESIS", "alike"))


def pytest_sessionstart(session: pytest.Session) -> None:
    """Collect no garbage while tests are collected: of a million objects that stay, every pass visits all."""
    gc.disable()


def pytest_collection_finish(session: pytest.Session) -> None:
    """Collect garbage again, as the commands do, without the objects of the collected tests."""
    gc.freeze()
    gc.set_threshold(GC_THRESHOLD)
    gc.enable()
