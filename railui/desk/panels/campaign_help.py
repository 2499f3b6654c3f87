"""Help of the Campaign panel."""

from __future__ import annotations

from typing import Final

CAMPAIGN_HELP: Final = """
## Campaign
`ctrl+o` opens a campaign and **checks its data**: faults to correct before fitting, and the fraction of each channel
that is not coherent with the track. `f` makes the corrections that the faults call for and starts the loop; `G` starts
it in spite of them. The files stay as they are.

`s` starts the loop: the nominal model is validated, its parameters are estimated (output-error method, sixteen
simulations at a time), and a score test searches the residual for unmodelled effects. **rho** is the correlation of the
residual with the sensitivity to a parameter; at the optimum every bar vanishes. The ranking fills as candidates are
tested. `p` pauses, `k` stops, `v` changes the view, `n` shows the next channel.

`]` and `[` change between the loop, its **verdict** and the list of **campaigns**. The verdict refers to the
validation runs; the shares are the parts of the squared error that each stage removed. A rival is undecided where
Vuong's test does not separate it from the final model; the next run is the one that would. `r` shows the next ranking.
`t` opens the calibrated design in the form, `w` writes the files of `railui loop`.

In the list, Enter opens the campaign under the cursor, `S` runs every campaign without a verdict one after another.
"""
