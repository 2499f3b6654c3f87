"""Robust spread of samples."""

from __future__ import annotations

from typing import Final

MAD_TO_SD: Final = 1.4826  # of a normal variable: 1 / Phi^-1(3/4), over its median absolute deviation
