"""Settings of the diagnosis of data faults."""

from __future__ import annotations

from dataclasses import dataclass

from railui.campaign.settings.declaration import setting


@dataclass(frozen=True)
class FaultSettings:
    """Faults of the recorded data: evidence, and the sizes from which they are reported or stop a fit."""

    min_fault_evidence: float = setting(
        40.0,
        minimum=5.0,
        meaning="Log-likelihood that the correction of a fault must gain.",
        provenance="trial: sound simulated campaigns stay below; planted faults gain 100 to 10000",
    )
    min_fault_evidence_share: float = setting(
        0.05,
        maximum=1.0,
        meaning="Log-likelihood per independent sample that the correction of a sign, unit or exchange must gain.",
    )
    tied_evidence_share: float = setting(
        0.02,
        maximum=1.0,
        meaning="Share of the gained log-likelihood up to which two corrections explain the data equally well.",
    )
    max_faults: int = setting(6, minimum=1, meaning="Faults of one run up to which the search goes on.")
    reported_gain_error: float = setting(0.08, maximum=1.0, meaning="Relative error of a gain that is reported.")
    reported_delay: float = setting(4e-3, unit="s", meaning="Delay of a channel that is reported.")
    serious_gain: float = setting(
        2.0, minimum=1.0, meaning="Gain, or its inverse, beyond which it is a data fault and no effect of a sensor."
    )
    serious_delay: float = setting(
        0.05, unit="s", meaning="Delay of one channel beyond which it is a data fault and no effect of a sensor."
    )
    serious_group_delay: float = setting(
        6e-3, unit="s", meaning="Common delay of several channels from which two loggers are not synchronised."
    )
    serious_track_offset: float = setting(
        0.1, unit="m", meaning="Offset along the line from which the track was recorded elsewhere."
    )
    gravity_tolerance: float = setting(
        0.3, maximum=1.0, meaning="Relative deviation from g of the gravity that an accelerometer feels through roll."
    )
    serious_clipped_share: float = setting(
        1e-3, maximum=1.0, meaning="Share of clipped or lost samples from which a channel is not fit for use."
    )
    clipping_pile_up: float = setting(
        5.0, minimum=1.0, meaning="Samples at an extreme over those just below it from which a channel is clipped."
    )
    hum_line_ratio: float = setting(
        30.0, minimum=2.0, meaning="Power of a line at the mains frequency over that of its neighbours."
    )
    serious_hum_share: float = setting(
        0.1, maximum=1.0, meaning="Share of a channel's power in the band from which hum is a data fault."
    )
    min_cross_level_share: float = setting(
        0.3,
        maximum=1.0,
        meaning="Share of the simulated response to the cross-level in the channels from which its sign is decided.",
        provenance="trial: sound simulated campaigns have a median of 0.4 to 1.3 over their channels",
    )
    opposed_correlation: float = setting(
        0.8,
        maximum=1.0,
        meaning="Correlation with the nominal model, at long wavelengths, from which it decides a sign or a unit.",
    )
