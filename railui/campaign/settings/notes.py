"""Settings of the notes in the loop report: when a result needs an explanation."""

from __future__ import annotations

from dataclasses import dataclass

from railui.campaign.settings.declaration import setting


@dataclass(frozen=True)
class NoteSettings:
    """Results that a note explains; none of them changes the verdict."""

    unreached_motion_ratio: float = setting(
        1.3,
        minimum=1.0,
        meaning="Motion on the validation runs over that on the estimation runs from which a law may act beyond.",
    )
    late_input_tolerance: float = setting(
        0.05, maximum=1.0, meaning="Relative difference up to which delays of all channels are one, of the input."
    )
    gradual_slip_ratio: float = setting(
        0.25,
        minimum=0.0,
        meaning="Speed at which a force saturates over the rms speed there, from which a damper with a blow-off valve "
        "is as likely as sliding surfaces.",
        provenance="conventional: the force is then below 0.9 of its limit in 29 % of the time of a Gaussian motion",
    )
    min_reached_ratio: float = setting(
        0.01,
        maximum=1.0,
        meaning="Time beyond a stop of a rig over that beyond the stop on its other side, from which the estimation "
        "runs reach both.",
        provenance="trial: up to 0.001 where the fit moves the other stop to the edge of the motion",
    )
