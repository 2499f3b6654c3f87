"""Page of the Python API: the public names in their order, from their docstrings."""

import railui
import railui.core

INTRODUCTION = """# Python reference

Objects, then functions; [Python](../python.md) introduces them with examples. All numbers are SI. Faulty input
raises `railui.FileProblems` (a `ValueError`) with file, line, key and remedy.
"""
CONTACT = """
## Contact

The functions behind `railui contact`, see [contact](../contact.md).

::: railui.contact
    options:
      show_root_heading: false
      show_root_toc_entry: false
      heading_level: 3
"""
KERNEL_MEMBERS = (
    "effect_catalogue",
    "parameter_paths",
    "simd_level",
    "Batch",
    "Vehicles",
    "Placement",
    "ZeroPhaseFilter",
    "RideStatistics",
)
KERNEL = f"""
## The kernel

`railui.core` is the interface to the kernel: batches of vehicles of one structure, rows of numbers in SI.

::: railui.core
    options:
      members: [{", ".join(KERNEL_MEMBERS)}]
      show_root_heading: false
      show_root_toc_entry: false
      heading_level: 3
"""


def page() -> str:
    """Return one section for each public name; ValueError where the kernel lacks a listed one."""
    missing = [name for name in KERNEL_MEMBERS if name not in railui.core.__all__]
    if missing:
        raise ValueError(f"railui.core has no {', '.join(missing)}")
    names = [f"\n::: {_module(name)}.{name}\n" for name in railui.__all__]
    return "".join([INTRODUCTION, *names, CONTACT, KERNEL])


def _module(name: str) -> str:
    return str(getattr(getattr(railui, name), "__module__", "railui"))
