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
    serious_distance_error: float = setting(
        0.1,
        meaning="Relative difference between s and the integral of v from which time, speed or distance is wrong.",
        provenance="derived: the time from one wheelset of a bogie to the next is off by serious_group_delay at 40 m/s",
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
    min_response_share: float = setting(
        0.1,
        maximum=1.0,
        meaning="Log-likelihood per independent sample that a correction must gain against the responses of vehicles.",
        provenance="trial: sound simulated campaigns stay below 0.06, planted faults gain 0.15 to 5",
    )
    min_gravity_response_share: float = setting(
        0.025,
        maximum=1.0,
        meaning="The same for gravity through roll, which acts at long wavelengths alone.",
        provenance="trial: sound simulated campaigns stay below 0.012",
    )
    response_vehicles: int = setting(
        48, minimum=1, meaning="Vehicles about the nominal model with whose responses the channels are compared."
    )
    response_parameter_log_sd: float = setting(
        0.3, maximum=1.0, meaning="Standard deviation of the logarithm of their estimated parameters."
    )
    response_drift: float = setting(
        8e-3, unit="s", meaning="Drift of a clock over a run that the response of the vehicle shows."
    )
    response_delay: float = setting(
        0.03, unit="s", meaning="Delay of a channel that the response of the vehicle shows, beyond those of its errors."
    )
    response_offset: float = setting(
        0.3, unit="m", meaning="Offset of the track that the response of the vehicle shows, beyond those of its errors."
    )
    wider_evidence_share: float = setting(
        0.7,
        maximum=1.0,
        meaning="Share of the evidence of a fault from which the same fault of more channels precedes it.",
    )
    opposed_correlation: float = setting(
        0.8,
        maximum=1.0,
        meaning="Correlation with the nominal model, at long wavelengths, from which it decides a sign or a unit.",
    )
    min_opposed_channels: int = setting(
        2,
        minimum=1,
        meaning="Channels that must all oppose the nominal model for the track to be the one with the wrong sign.",
    )
    following_wavelength: float = setting(
        28.0, unit="m", minimum=1.0, meaning="Wavelength from which on wheelsets and frame follow the track."
    )
    min_following_frequency: float = setting(
        0.4, unit="Hz", minimum=0.01, meaning="Lowest frequency at which channels are compared with the nominal model."
    )
    min_following_lines: int = setting(
        3, minimum=1, meaning="Frequencies between these limits that a comparison with the nominal model needs."
    )
    min_unit_gain: float = setting(
        6.0,
        minimum=1.0,
        meaning="Gain over the nominal model, or its inverse, from which the unit of a channel is wrong.",
    )
    unit_tolerance: float = setting(
        1.6, minimum=1.0, meaning="Factor up to which the gain of a channel may differ from that of a wrong unit."
    )
    nominal_duration: float = setting(
        60.0, unit="s", minimum=1.0, meaning="First part of a segment that is compared with the nominal model."
    )
    cross_level_standard_errors: float = setting(
        3.0,
        meaning="Standard errors by which a channel's share of the response to the cross-level must differ from zero.",
        provenance="conventional: three standard errors, some 99.7 % two-sided",
    )
    free_value_penalty: float = setting(
        8.0,
        meaning="Log-likelihood by which a fault with a free value must exceed a sign, a unit or an exchange.",
    )
    consistent_log_share: float = setting(
        -2.0,
        minimum=None,
        maximum=0.0,
        meaning="Logarithm of the inconsistent share of power, in the most consistent quarter of the band, below "
        "which the channels of a run are consistent.",
    )
    local_lag: float = setting(
        0.06, unit="s", minimum=0.01, meaning="Largest lag that is tried where the channels are consistent already."
    )
    fault_standard_errors: float = setting(
        4.0, meaning="Standard errors by which a gain, a delay or an offset must differ from none."
    )
    min_clock_drift: float = setting(3e-3, unit="s", meaning="Drift of a clock over the run from which it is a fault.")
    min_clock_evidence: float = setting(
        25.0, meaning="Log-likelihood that a drifting clock must gain beyond a constant delay."
    )
    gain_spread: float = setting(0.05, meaning="Range of a gain over the runs up to which it is one fault.")
    delay_spread: float = setting(1.5e-3, unit="s", meaning="Range of a delay over the runs up to which it is one.")
    offset_spread: float = setting(
        0.06, unit="m", meaning="Range of an offset along the line over the runs up to which it is one."
    )
    gravity_spread: float = setting(
        3.0, unit="m/s^2", meaning="Range of the gravity through roll over the runs up to which it is one fault."
    )
    clock_spread: float = setting(
        3e-5, meaning="Range of the relative rate of a clock over the runs up to which it is one fault."
    )
    relative_spread: float = setting(
        0.03, maximum=1.0, meaning="The same of a gain, a delay or an offset relative to its mean, where that is more."
    )
    min_equal_samples: int = setting(
        3, minimum=2, meaning="Equal samples in a row that count as clipped at an extreme, or as lost before a jump."
    )
    min_fault_events: int = setting(
        3, minimum=1, meaning="Events of clipping or of dropouts from which they are reported."
    )
    clipping_side_share: float = setting(
        0.005,
        maximum=1.0,
        meaning="Share of a channel's range just below an extreme with which the samples at it are compared.",
    )
    max_approach_density: float = setting(
        1.8,
        minimum=1.0,
        meaning="Density of samples just below a noisy plateau over that further below, up to which the channel is "
        "cut off and does not come to rest.",
        provenance="derived: 2.05 to 3 where a sine comes to rest; 1.26 and 1.72 where 80 and 95 % of it are left",
    )
    max_resting_acceleration: float = setting(
        0.3,
        maximum=1.0,
        meaning="Acceleration on a plateau of the displacement over that of the whole run, up to which a mass rests.",
        provenance="derived: above 1 where the displacement of a vibration is cut off, whose acceleration is largest",
    )
    min_repeated_samples: int = setting(
        5,
        minimum=2,
        meaning="Equal samples in a row that count as lost in a channel of full resolution, without a jump.",
    )
    fine_repeat_share: float = setting(
        0.01, maximum=1.0, meaning="Share of repeated values up to which a channel has its full resolution."
    )
    dropout_jump_steps: float = setting(
        10.0, minimum=1.0, meaning="Jump at an end of a dropout over the usual difference of two samples, at least."
    )
    dropout_jump_sd: float = setting(
        0.3, meaning="Jump at an end of a dropout over the standard deviation of the channel, at least."
    )
    hum_turn_clearance: float = setting(
        0.7, unit="Hz", meaning="Distance from a multiple of the wheels' rotation up to which a line is no mains hum."
    )
    hum_harmonic_ratio: float = setting(
        3.0,
        minimum=1.0,
        meaning="Power of a line at a mains frequency over the lines some periods of a periodic drive away, "
        "up to which it is a harmonic of the drive.",
        provenance="trial: at most 1.2 with dry friction, a damper with a knee or an asymmetric one under sines; above "
        "400 with hum of 1 % and more",
    )
    periodic_drive_share: float = setting(
        0.8,
        maximum=1.0,
        meaning="Share of the power of a drive at multiples of its strongest line from which it is periodic.",
        provenance="derived: 1 for sines and triangles; some 0.05 for broad-band drives",
    )
    intermittent_contrast: float = setting(
        2.0,
        minimum=1.0,
        meaning="Disagreement of a channel with the others in four of five windows of an interval over that in four of "
        "five other windows, as a power, from which it has a fault during a part of the run.",
        provenance="trial: at most 1.5 in 700 sound simulated and measured runs; 4.6 to 1000 with a gain of 0.8, "
        "2.9 to 9 with five times the noise where four relations hold",
    )
    intermittent_level: float = setting(
        1e-3,
        maximum=1.0,
        meaning="Probability, over all channels, runs and intervals, of such a difference by chance.",
        provenance="conventional: family-wise level, by Bonferroni's inequality",
    )
    max_restored_ratio: float = setting(
        1.6,
        minimum=1.0,
        meaning="Disagreement of the other channels in that interval over that outside, up to which they agree there.",
        provenance="trial: at most 1.2 without the faulty channel",
    )
    serious_intermittent_ratio: float = setting(
        6.0,
        minimum=1.0,
        meaning="Disagreement of a channel in an interval over that outside, as a power, from which it is not fit for "
        "use.",
        provenance="derived: some 2.5 times the noise",
    )
    min_unit_decades: int = setting(
        2,
        minimum=1,
        meaning="Powers of ten by which the response of a rig must be off in one run for another unit there.",
    )
    max_unit_deviation: float = setting(
        0.35,
        maximum=0.5,
        meaning="Deviation of that ratio from a power of ten, in decades: a law that is not linear changes it, too.",
    )
    delayed_agreement: float = setting(
        0.95,
        maximum=1.0,
        meaning="Mean cosine of the phase between the force of two runs of a bench, from which a delay explains all.",
        provenance="trial: simulated components of any law with planted delays exceed 0.99",
    )
    min_agreement_gain: float = setting(
        0.2, maximum=1.0, meaning="Gain of that mean cosine by which a delay must bring the runs of a bench together."
    )
    min_delay_turns: float = setting(
        0.25,
        meaning="Periods of the frequencies in common by which a delay must turn the phase of a bench's force.",
        provenance="derived: a spring and a damper differ by 90 degrees, a quarter of a period",
    )
    nominal_agreement: float = setting(
        0.5,
        maximum=1.0,
        meaning="Mean cosine of the phase to the nominal model from which it decides which channel of a rig is wrong.",
    )
    max_nominal_decades: float = setting(
        0.5, maximum=0.5, meaning="Decades by which the nominal model of a rig may be off to decide on a unit."
    )
    min_explained_share: float = setting(
        0.5,
        maximum=1.0,
        meaning="Share of a channel of a rig that its response to the input explains, from which it is compared with "
        "the nominal model.",
    )
    min_exchange_gain: float = setting(
        1.0,
        meaning="Decades, and cosine of the phase, by which the responses of a rig must come nearer to the nominal "
        "model for two columns to be exchanged.",
    )
    reversed_agreement: float = setting(
        0.8,
        maximum=1.0,
        meaning="Mean cosine of the phase between the responses of a rig and those of a model about the nominal one, "
        "with the opposite sign, from which a sign is wrong.",
    )
    min_header_decades: float = setting(
        0.5,
        maximum=1.0,
        meaning="Decades by which the header units of a rig must differ from one system, and share of these by which "
        "the response may differ from the nominal model in SI.",
        provenance="derived: at 0.5 the response is nearer to the nominal model in SI than in the numbers of the runs",
    )
    absolute_acceleration_tolerance: float = setting(
        0.2,
        maximum=0.5,
        meaning="Relative deviation of az - z'' from the acceleration of the base up to which az is the absolute one.",
    )
    min_steady_motion: float = setting(
        0.9,
        meaning="Motion in the last third of a run over that in the first, from which a rig without input is driven.",
        provenance="trial: measured and simulated free decays stay below 0.8",
    )
    min_record_periods: float = setting(
        2.0, meaning="Periods of its motion below which a record of a rig or a component is reported as short."
    )
