"""Settings of the noise model: weights of stated and estimated noise."""

from __future__ import annotations

from dataclasses import dataclass

from railui.campaign.settings.declaration import setting


@dataclass(frozen=True)
class NoiseSettings:
    """Noise of the columns, with the stated noise as a log-normal prior."""

    max_datum_ratio: float = setting(
        1.0,
        minimum=0.0,
        meaning="Mean line of yw over yw about this line, as rms values, up to which the line remains.",
        provenance="trial: at most 0.03 in 379 runs on simulated tracks, 6 with a datum 10 mm off",
    )
    short_run_datum_factor: float = setting(
        5.0, minimum=1.0, meaning="Factor of this limit in runs below 300 m, whose mean line may be an irregularity."
    )
    stated_noise_factor: float = setting(
        2.0,
        minimum=1.01,
        meaning="Factor that one standard deviation of the log-normal prior about a stated noise spans.",
    )
    quiet_noise_factor: float = setting(
        1.3, minimum=1.01, meaning="The same of a white noise level from the top of a channel's spectrum, at least."
    )
    min_coherent_top: float = setting(
        0.5,
        maximum=1.0,
        meaning="Share of a rig's channel, at the top of its spectrum, that is coherent with the input, from which "
        "only the rest of it is noise.",
        provenance="derived: a smaller share raises an amplitude by less than 1.42",
    )
    min_flicker_z: float = setting(
        6.0,
        minimum=0.0,
        meaning="Estimate of a part 1/f over its standard deviation from which a channel has flicker noise.",
        provenance="trial: at most 4 with white noise, at least 8 with 1/f noise on vehicles simulated for 70 s",
    )
    min_flicker_share: float = setting(
        0.8,
        maximum=1.0,
        meaning="Share that this part must have at three quarters of half the sampling rate.",
        provenance="trial: the motions of a flange contact reached 0.65",
    )
    max_flicker_deviation: float = setting(
        0.18, meaning="Relative deviation of a band from white and 1/f noise from which it contains motions."
    )
    relation_noise_factor: float = setting(
        1.05, minimum=1.001, meaning="The same of a level from kinematic relations between channels, at least."
    )
    undetermined_noise_factor: float = setting(
        2.0, minimum=1.01, meaning="The same from which a level counts as not determined by the data."
    )
    unknown_noise_factor: float = setting(
        5.0, minimum=1.01, meaning="The same of the prior of a channel or of rails without stated noise."
    )
    rail_noise_share: float = setting(
        0.01,
        minimum=1e-6,
        meaning="Centre of the prior of rails without stated noise, in the standard deviation of the alignment.",
    )
    max_rail_noise_share: float = setting(
        0.3,
        minimum=1e-6,
        meaning="Noise of the track without stated noise up to which a residual may be that noise, in the standard "
        "deviation of the alignment.",
        provenance="chosen by hand: 0.5 mm of an alignment of 1.7 mm; a record with more is no reference",
    )
    max_quiet_excess: float = setting(
        1.5,
        minimum=1.0,
        meaning="Amplitude at the top of a spectrum over its incoherent part, beyond which it contains motions.",
    )
    relation_information_share: float = setting(
        0.5,
        minimum=1e-3,
        maximum=1.0,
        meaning="Share of the independent windows that counts: relations are not exact, and noise is not Gaussian.",
    )
    max_following_share: float = setting(
        0.3,
        maximum=1.0,
        meaning="Share of a kinematic relation's power that may follow the track in channels that are used.",
    )
    min_coloured_share: float = setting(
        1e-3,
        maximum=1.0,
        meaning="Share of the variance in the band below which a coloured part of a noise is left out.",
    )
    max_speed_noise_share: float = setting(
        0.01,
        maximum=1.0,
        meaning="Noise of the speed of a rig's prescribed motion over that speed from which the motion is smoothed.",
        provenance="trial: at most 0.002 in the records of the bundled damper; 4 um of noise at 500 samples/s make 0.1",
    )
    motion_noise_ratio: float = setting(
        10.0,
        minimum=1.0,
        meaning="Power of a prescribed motion over that of its noise, up to the last frequency of which it reaches.",
        provenance="derived: the mean of five lines of white noise exceeds it with a probability of 1e-17",
    )
    max_input_slope: float = setting(
        0.15,
        meaning="Difference of the logarithms of a driving column's density, from 0.5 to 0.7 and from 0.7 to 0.9 of "
        "half the sampling rate, up to which it is white noise there.",
        provenance="derived: 0.29 of an input whose power falls as 1/f; trial: at most 0.04 of white noise",
    )
    max_input_noise: float = setting(
        0.3,
        maximum=1.0,
        meaning="Standard deviation of that white part over that of the column, beyond which it is a drive.",
    )
    max_followed_share: float = setting(
        0.05,
        maximum=1.0,
        meaning="Share of the frequencies without other input at which a channel may follow that white part, each "
        "with a chance of 0.01, for it to be noise.",
        provenance="trial: at most 0.03 of noise; 0.54 of the blows of a hammer",
    )
    min_input_samples: int = setting(
        4000,
        minimum=64,
        meaning="Samples of the runs of a rig from which the noise of its input is estimated.",
        provenance="derived: the logarithms then differ by 0.06, one standard deviation, by chance",
    )
    max_noise_over_residual: float = setting(
        1.5,
        minimum=1.0,
        meaning="Noise of a channel, estimated from the runs, over the residual of a model in the compared band, "
        "beyond which the residual is its upper bound.",
        provenance="trial: at most 1.02 on sound simulated rigs; 2.7 to 100 where motion fills the whole spectrum",
    )
    max_drift_share: float = setting(
        0.005,
        maximum=1.0,
        meaning="Slow part of a channel in a free decay over the channel from which its sensor drifts.",
        provenance="trial: at most 0.0033 in the swings of a measured pendulum, 0.01 to 0.02 with 5 % of drift",
    )
