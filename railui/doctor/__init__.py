"""Doctor: published values against what this installation computes, and the machine."""

from railui.doctor.checks import Check, doctor

__all__ = ["Check", "doctor"]
