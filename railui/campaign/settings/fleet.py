"""Settings of a fleet: which runs are compared, how a vehicle is tracked, and when it raises an alarm."""

from __future__ import annotations

from dataclasses import dataclass

from railui.campaign.settings.declaration import Setting, declared, setting


@dataclass(frozen=True)
class FleetSettings:
    """Tracking of vehicles and sequential tests."""

    reference_runs: int = setting(
        5, minimum=1, meaning="First runs of a vehicle, from which its reference model is calibrated."
    )
    run_prior_share: float = setting(
        0.5, minimum=1e-3, meaning="Prior standard deviation of a parameter in one run, relative to the reference."
    )
    min_determined_share: float = setting(
        0.5,
        maximum=1.0,
        meaning="Share of the prior variance that one run must remove for a parameter to be monitored.",
    )
    block_days: float = setting(
        7.0, minimum=1e-6, meaning="Length [day] of a block, whose runs make one score of the sequential test."
    )
    baseline_blocks: int = setting(
        8, minimum=2, meaning="First blocks of a vehicle, which the tests do not use: its level is learnt from them."
    )
    reset_blocks: int = setting(
        4, minimum=1, meaning="Blocks after maintenance, or after an alarm, in which a level is learnt anew."
    )
    false_alarms: float = setting(
        0.02,
        minimum=1e-9,
        maximum=10.0,
        meaning="Rate of false alarms, per vehicle and month, for which the thresholds of the tests are computed.",
    )
    reference_value: float = setting(
        0.5,
        minimum=0.05,
        meaning="Reference value of the CUSUM: half the shift, in standard deviations of a block, to detect fastest.",
        provenance="conventional: D. C. Montgomery, Introduction to Statistical Quality Control",
    )
    least_spread: float = setting(
        0.002,
        meaning="Least standard deviation of a block, relative to the nominal value or in amounts: less is no change.",
    )
    max_score: float = setting(
        4.0,
        minimum=1.0,
        meaning="Largest score of a block that the CUSUM adds, so that no single block raises an alarm.",
    )
    min_scores: int = setting(
        30,
        minimum=2,
        meaning="Scores of a quantity from which their scale and the random walk of its level are learnt.",
    )
    least_scale: float = setting(
        0.5,
        minimum=1e-3,
        meaning="Least scale of the scores of a quantity, relative to the standard normal distribution.",
    )
    error_bound: float = setting(
        3.0,
        minimum=1.0,
        meaning="Largest prediction error, in robust standard deviations, that the likelihood of a random walk counts.",
        provenance="conventional: P. J. Huber, Robust Statistics (1981)",
    )
    min_sisters: int = setting(
        3, minimum=1, meaning="Other vehicles on the same section in the same block from which their mean is a control."
    )
    separation: float = setting(
        6.0,
        meaning="Difference of the explained deviance below which two explanations of a change are not separated.",
        provenance="conventional: likelihood ratio 20",
    )
    min_explained: float = setting(
        0.5,
        maximum=1.0,
        meaning="Share of the deviance of a change that one explanation must reach; below, its misfit decides.",
    )
    misfit_probability: float = setting(
        0.01,
        maximum=1.0,
        meaning="Probability of the misfit of the best explanation, below which the change is `outside`.",
        provenance="conventional: goodness of fit at 1 %",
    )
    min_deviance: float = setting(
        12.0,
        minimum=0.0,
        meaning="Deviance that the best explanation must reach; below, the change is `outside`.",
        provenance="chi-squared of one degree of freedom at 1 % over 20 explanations (Bonferroni)",
    )


FLEET_SETTINGS: dict[str, Setting] = {s.name: s for s in declared("fleet", FleetSettings)}
