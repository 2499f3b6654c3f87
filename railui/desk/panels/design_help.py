"""Help of the Design panel."""

from typing import Final

DESIGN_HELP: Final = """
## Design
After every change the design is simulated on its track; ride quality, spectra, modes and series are shown with those
of the **base** (grey): the file as it was read, or the design at the last `b` (`B`: the file again). `x` swaps the two
(A/B comparison).
`ctrl+z` undoes, `ctrl+y` redoes: design, base, track and speed. `ctrl+s` writes the changed numbers into the file and
keeps its comments; it asks before it replaces what another program wrote.
`]` and `[` change between six pages. Overview: ride quality and plots. Stability (`l`): the linear and the nonlinear
critical speed and the speed limit by ride criteria on this track, damping of the named modes, root locus, limit cycles.
Speed: ride quality against speed, mean and range over five track seeds. Map: ride quality over two parameters.
Vehicle: drawing and animation of the vehicle. Shelf: designs that were kept, compared.
`v` shows other plots, `a` adds an effect of the catalogue, Delete removes the one under the cursor.
Track and speed (top of the form) are settings of the desk, not of the file. Sum Y: sum of guiding forces of the
leading wheelset. Flange time: proportion of time with flange contact.
"""
