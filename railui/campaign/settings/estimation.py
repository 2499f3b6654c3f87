"""Settings of parameter estimation, noise floor and identifiability."""

from __future__ import annotations

from dataclasses import dataclass

from railui.campaign.settings.declaration import setting


@dataclass(frozen=True)
class CalibrationSettings:
    """Output-error fit: what a model may be, and how many independent samples its residual has."""

    conicity_step: float = setting(
        0.8,
        maximum=0.99,
        meaning="Factor by which the conicity is lowered repeatedly until the nominal model is stable.",
    )
    max_growth_rate: float = setting(
        -0.02,
        unit="1/s",
        minimum=None,
        maximum=0.0,
        meaning="Largest growth rate of the least stable mode that a fit over whole runs may reach.",
    )
    max_steps_per_sample: int = setting(
        16,
        minimum=1,
        meaning="Integration steps per sample above which a vehicle is too stiff for a fit.",
    )
    damped_mode_step: float = setting(
        1.5,
        minimum=1.0,
        maximum=2.0,
        meaning="Largest product of time step and natural angular frequency of damped linear modes in simulations of "
        "sensitivities and output differences; it is 1 in residuals, for other modes, and in fits that this misleads.",
        provenance="chosen by hand: the normal equations of a bogie change by less than 5e-3 of their size",
    )
    independent_sample_share: float = setting(
        0.4,
        maximum=1.0,
        meaning="Share of the samples that counts as independent where the misfit is weighed against priors.",
    )
    given_up_gains: float = setting(
        20.0,
        minimum=1.0,
        meaning="Gains like the last that leave a fit above its limit of the misfit where it is given up.",
    )
    bias_draws: int = setting(
        3, minimum=2, meaning="Pairs of noise realisations behind the bias of the estimates from track noise."
    )
    bias_misfit_share: float = setting(
        0.02,
        meaning="Rise of the misfit up to which estimates are corrected for their bias; beyond it their spread grows.",
    )
    parameter_samples: int = setting(
        64,
        minimum=1,
        meaning="Samples of the estimates that a calibrated design carries for studies, each checked by a simulation.",
    )
    rig_parameter_range: float = setting(
        100.0,
        minimum=1.0,
        meaning="Bound of a rig's parameter, in its usual size.",
    )
    min_slip_share: float = setting(
        3e-3,
        minimum=1e-9,
        maximum=1.0,
        meaning="Least slip speed of friction on a rig, in the standard deviation of the rate of its motion.",
    )
    curve_prior_sd: float = setting(
        2.0,
        meaning="Prior standard deviation of the points of a force curve, in its largest force.",
    )
    element_prior_share: float = setting(
        0.5,
        meaning="Prior standard deviation of stiffness, damping and effects of a nominal vehicle of bodies, in their "
        "nominal values (none where that is zero); and of a number without influence, in its nominal value or 1 % of "
        "its range, whichever is larger.",
    )
    prior_drift: float = setting(
        0.05,
        meaning="Relative change of a parameter since an earlier campaign that adds to the spread of its prior.",
    )
    block_hunting_periods: float = setting(
        3.0,
        meaning="Hunting periods in a block of time; residuals in different blocks count as uncorrelated.",
        provenance="conventional: a block several correlation lengths long (heteroscedasticity- and "
        "autocorrelation-consistent covariance); the number 3 was chosen by hand; fewer where `block_count` asks for "
        "more blocks",
    )
    block_count: float = setting(
        12.0,
        minimum=4.0,
        meaning="Number of blocks of time below which they are shortened, as those of a coach, whose body sways "
        "slowly: few blocks leave the standard deviations of the estimates uncertain.",
        provenance="chosen by hand: from 12 blocks a standard deviation scatters by 1/sqrt(22), 21 %, and random signs "
        "have patterns enough for the score test; coverage in trials of simulated coaches hardly distinguishes 7 to 20",
    )
    min_block_duration: float = setting(1.0, unit="s", meaning="Shortest block of time.")
    rig_block_count: float = setting(50.0, minimum=2.0, meaning="Blocks of time in a record of a rig.")
    rig_samples_per_second: float = setting(
        400.0,
        minimum=1.0,
        meaning="Samples of a rig's record that count as one second where the first seconds of a run are taken.",
    )


@dataclass(frozen=True)
class InitialStateSettings:
    """Initial-state estimation: the part of a run it uses and the prior spread of the state."""

    initial_state_duration: float = setting(
        4.0, unit="s", minimum=0.1, meaning="First part of a segment from which its initial state is estimated."
    )
    initial_displacement: float = setting(
        5e-3, unit="m", minimum=1e-9, meaning="Usual initial lateral displacement of a body: the ridge of the estimate."
    )
    initial_yaw: float = setting(
        3e-3, unit="rad", minimum=1e-9, meaning="Usual initial yaw of a body: the ridge of the estimate."
    )
    initial_velocity: float = setting(
        0.05, unit="m/s", minimum=1e-9, meaning="Usual initial lateral velocity of a body: the ridge of the estimate."
    )
    initial_yaw_rate: float = setting(
        0.03, unit="rad/s", minimum=1e-9, meaning="Usual initial yaw rate of a body: the ridge of the estimate."
    )
    min_channel_noise_share: float = setting(
        0.02,
        minimum=1e-6,
        meaning="Smallest noise of a channel that the estimate counts with, as a share of its standard deviation.",
    )


@dataclass(frozen=True)
class WindowSettings:
    """Multiple shooting: vehicles near their hunting limit, or out of step with the motion, are fitted on windows."""

    window_duration: float = setting(3.0, unit="s", minimum=0.5, meaning="Length of a window of multiple shooting.")
    windowed_growth_rate: float = setting(
        -1.0,
        unit="1/s",
        minimum=None,
        maximum=0.0,
        meaning="Growth rate from which a segment is cut into windows: the vehicle is near its hunting limit there.",
    )
    slipped_misfit: float = setting(
        1.0,
        minimum=0.1,
        meaning="Squared residual over squared signal in a block of a run from which a model is out of step with it.",
        provenance="derived: a residual larger than the signal is worse than no model",
    )
    followed_misfit: float = setting(
        0.25,
        minimum=0.01,
        maximum=1.0,
        meaning="The same up to which windows are lengthened.",
        provenance="derived: half the signal, a phase error of about 30 degrees",
    )
    first_window_periods: float = setting(
        2.0, minimum=0.5, meaning="Periods of the motion in the shortest windows of a model that is out of step."
    )
    misfit_blocks: int = setting(
        20,
        minimum=1,
        meaning="Blocks of a run, each at least a period long, in which squared residual and signal are compared.",
    )
    min_block_power_share: float = setting(
        1e-2, maximum=1.0, meaning="Share of the mean power of a run below which a block is left out of it."
    )
    max_windows: int = setting(
        40, minimum=4, meaning="Windows of growing length that are fitted at once, evenly spread over the runs."
    )


@dataclass(frozen=True)
class ValidationSettings:
    """Validation error and noise floor: blocks of squared error and the number of noise realisations."""

    error_block_duration: float = setting(
        2.0,
        unit="s",
        minimum=0.1,
        meaning="Block of time over which squared validation errors are summed for the standard error of a gain.",
    )
    min_error_blocks: int = setting(
        4, minimum=1, meaning="Blocks that a validation segment must exceed; a shorter one is cut into equal parts."
    )
    short_segment_parts: int = setting(
        20,
        minimum=2,
        meaning="Equal parts into which a validation segment of few blocks is cut for the standard error of a gain.",
    )
    test_share: float = setting(
        1 / 3,
        minimum=0.0,
        maximum=0.9,
        meaning="Share of every validation run that is held back for the test, without runs of role test.",
    )
    min_test_duration: float = setting(
        10.0, unit="s", minimum=0.1, meaning="Shortest part of a validation run that is held back, and that is left."
    )
    min_test_samples: int = setting(
        1000, minimum=1, meaning="Fewest samples of such a part: a run of less than 100 samples/s needs a longer one."
    )
    contradiction_level: float = setting(
        0.01,
        minimum=1e-4,
        maximum=0.5,
        meaning="Level of the paired test over blocks from which a higher error on the test segments contradicts the"
        " effects.",
        provenance="conventional: 1 %, as the score test",
    )
    max_start_share: float = setting(
        0.25,
        maximum=0.9,
        meaning="Largest share of a test segment that is left out at its start, where its initial state is estimated.",
    )
    max_first_order_change: float = setting(
        0.3,
        maximum=1.0,
        meaning="Change of a run's response, over its rms, by the parameters estimated without it, up to which its "
        "error is computed to first order.",
        provenance="derived: 0.3 rad of a phase, of which the second order is 0.05; trial: 2 and 200 on simulated rigs "
        "with a stop of which one run determines the parameters",
    )
    noise_floor_draws: int = setting(10, minimum=2, meaning="Noise realisations behind the noise floor.")
    preliminary_floor_draws: int = setting(
        5, minimum=2, meaning="Noise realisations behind the noise floor that only steers the selection."
    )
    noise_weight_draws: int = setting(3, minimum=1, meaning="Noise realisations behind the weights of the channels.")


@dataclass(frozen=True)
class IdentifiabilitySettings:
    """Identifiability: from which spread a parameter counts as determined."""

    determined_sd: float = setting(
        0.10, meaning="Relative standard deviation up to which a parameter counts as determined."
    )
    roughly_determined_sd: float = setting(
        0.5, meaning="Relative standard deviation up to which a parameter counts as roughly determined."
    )
    direction_part: float = setting(
        0.3, maximum=1.0, meaning="Component of a direction from which its parameter is listed."
    )
    partner_correlation: float = setting(
        0.7, maximum=1.0, meaning="Correlation from which two parameters are determined in combination only."
    )
    unseen_prior_share: float = setting(
        0.9,
        maximum=1.0,
        meaning="Share of the prior's standard deviation that remains where the data do not determine a parameter.",
    )
    held_correlation: float = setting(
        0.5,
        maximum=1.0,
        meaning="Correlation with a parameter that only a prior determines from which an estimate is followed over the "
        "width of that prior.",
    )
    flagged_correlation: float = setting(
        0.95, maximum=1.0, meaning="Correlation with another parameter from which an estimate is flagged as correlated."
    )
    min_section_blocks: int = setting(
        5, minimum=2, meaning="Blocks of time that a track section needs for parameters of its own."
    )
