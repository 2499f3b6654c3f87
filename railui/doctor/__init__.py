"""Doctor: published values against what this installation computes, and the machine."""

from railui.doctor.check import Check
from railui.doctor.self_test import doctor

__all__ = ["Check", "doctor"]
