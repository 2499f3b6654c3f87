"""railui capture: exit codes of its check and of its campaign."""

from __future__ import annotations

import os
import pty
import tty
from pathlib import Path

import numpy as np
import pytest

from tests.cli.runner import ROOT, run

MAP = str(ROOT / "designs/maps/demo_logger.yaml")
RECORDINGS = ("--map", MAP, "--adjust", "monday", "--validate", "tuesday")


def test_the_check_of_a_missing_port_may_be_repeated_later(tmp_path: Path) -> None:
    result = run("capture", str(tmp_path / "none"), "--check")
    assert result.exit_code == 3 and "does not open" in result.stderr


def test_the_check_of_a_silent_port_may_be_repeated_later(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("railui.cli.capture.check.LISTEN_TIMEOUT", 0.3)
    master, port = pty.openpty()
    tty.setraw(port)
    try:
        result = run("capture", os.ttyname(port), "--check")
    finally:
        os.close(master)
        os.close(port)
    assert result.exit_code == 3 and "no hello in 0.3 s" in result.stderr


def test_a_campaign_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "campaign.yaml").write_text("name: precious\n")
    result = run("capture", "campaign", *RECORDINGS, "-o", str(tmp_path))
    assert result.exit_code == 2 and "exists and is not overwritten" in result.stderr
    assert (tmp_path / "campaign.yaml").read_text() == "name: precious\n"


def test_a_numerical_error_of_a_campaign_is_no_wrong_use(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise np.linalg.LinAlgError("singular matrix")

    monkeypatch.setattr("railui.api.recorded_campaign._build_runs", fail)
    result = run("capture", "campaign", *RECORDINGS, "-o", str(tmp_path / "campaign"))
    assert result.exit_code == 1 and "singular matrix" in result.stderr and "Usage" not in result.stderr
