"""The page of the Python API: the public names, in their order, from their docstrings."""

import railui

INTRODUCTION = """# Python

Every command has a function of the same name that returns what the command's JSON holds. All numbers are SI; everything that
is wrong raises `railui.io.problems.FileProblems` (a `ValueError`) with file, line, key and remedy.

```python
import railui

design = railui.load("designs/test_bogie.yaml")
stiffer = design.with_values({"vehicle.primary.lateral_stiffness": "4 MN/m"})
for vehicle in (design, stiffer):
    answer = railui.ride(vehicle, "erri_b176_low length=2000 seed=1", "144 km/h")
    print(answer["score"], answer["class"], answer["decided_by"])
```

The names below are read when they are asked for, so `import railui` is quick.
"""
CONTACT = """
## Contact

What `railui contact` is made of, see [contact](../contact.md).

::: railui.contact
    options:
      show_root_heading: false
      show_root_toc_entry: false
      heading_level: 3
"""
KERNEL = """
## The kernel

`railui.core` is the one door to the kernel: batches of vehicles of one structure, rows of numbers in SI.

::: railui.core
    options:
      members: [catalogue, parameters, simd, Batch, Vehicles, Placement, Filter, Rides]
      show_root_heading: false
      show_root_toc_entry: false
      heading_level: 3
"""


def page() -> str:
    """One section for each public name."""
    homes = railui._HOMES
    parts = [INTRODUCTION]
    for name in railui.__all__:
        home = homes.get(name, "railui")
        parts.append(f"\n::: {home}.{name}\n")
    return "".join([*parts, CONTACT, KERNEL])
