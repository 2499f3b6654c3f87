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
    held_input_tolerance: float = setting(
        0.1,
        maximum=0.5,
        meaning="Relative difference of a sensor's delay from half an interval between samples, up to which it may be "
        "that of an input held from sample to sample.",
        provenance="derived: a zero-order hold delays by exactly that; trial: 0.018 off on a simulated rig",
    )
    min_held_step: float = setting(
        0.5,
        minimum=0.0,
        meaning="Rms difference of an input from one sample to the next, over its standard deviation, from which it "
        "matters whether it is held or interpolated between them.",
        provenance="derived: 1.41 of white noise, 0.5 of a sine with 12.4 samples in a period",
    )
    gradual_slip_ratio: float = setting(
        0.25,
        minimum=0.0,
        meaning="Speed at which a force saturates over the rms speed there, from which a damper with a blow-off valve "
        "is as likely as sliding surfaces.",
        provenance="conventional: the force is then below 0.9 of its limit in 29 % of the time of a Gaussian motion",
    )
    max_equation_error_share: float = setting(
        0.1,
        maximum=1.0,
        meaning="Squared equation error of a rig with a law, over that without it, up to which its equation of motion "
        "holds with this law.",
        provenance="trial: 0.0002 to 0.04 with the true law on simulated rigs of ten samples in a period, 0.1 and more "
        "with other laws whose simulations follow",
    )
    sensitive_growth: float = setting(
        1e4,
        minimum=1.0,
        meaning="Growth of a small difference between two simulations of a rig from which its motion is sensitive.",
        provenance="trial: 1e5 and more on simulated chaotic rigs, up to 2e3 for some time on rigs with a stop that "
        "simulations follow",
    )
    min_reached_ratio: float = setting(
        0.01,
        maximum=1.0,
        meaning="Time beyond a stop of a rig over that beyond the stop on its other side, from which the estimation "
        "runs reach both.",
        provenance="trial: up to 0.001 where the fit moves the other stop to the edge of the motion",
    )
