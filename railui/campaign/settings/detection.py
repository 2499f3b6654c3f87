"""Settings of structure detection: score test, candidate refit and stepwise selection."""

from __future__ import annotations

from dataclasses import dataclass

from railui.campaign.settings.declaration import setting


@dataclass(frozen=True)
class ScoreTestSettings:
    """Score test of the residual against small amounts of every candidate effect."""

    effect_amount: float = setting(
        0.05,
        minimum=1e-6,
        meaning="Amount of a candidate effect, of its shape's size, simulated for its score.",
    )
    linear_effect_amount: float = setting(
        5e-4,
        minimum=1e-9,
        meaning="The same for a spring or a damper, of which the estimated parameters absorb nearly all.",
        provenance="derived: at 5 % the curvature of the absorbed part exceeds what is left of it",
    )
    score_duration: float = setting(
        40.0, unit="s", minimum=1.0, meaning="First part of every segment that the score test uses."
    )
    preselection_duration: float = setting(
        12.0, unit="s", minimum=1.0, meaning="First part of every segment on which candidates are preselected."
    )
    max_preselection_share: float = setting(
        0.7,
        maximum=1.0,
        meaning="Share of the samples in the first part from which a preselection on it saves nothing.",
    )
    preselected_candidates: int = setting(
        12, minimum=1, meaning="Candidates that are scored on the whole part after preselection."
    )
    divided_groups: int = setting(
        10,
        minimum=1,
        meaning="Groups of joints of a vehicle of bodies, the best first, whose single joints are candidates as well.",
    )
    searched_joints: int = setting(
        4,
        minimum=0,
        meaning="Best candidates at single joints of a vehicle of bodies, at whose joints every other law is scored.",
    )
    retained_shapes: int = setting(
        3,
        minimum=1,
        meaning="Shapes of an effect at a group of joints of a vehicle of bodies, the best first, that are scored at"
        " single joints and on the whole part.",
    )
    max_step_doublings: int = setting(
        2,
        minimum=0,
        meaning="Doublings of the integration steps of the calibrated model up to which a candidate is simulated.",
    )
    min_remaining_share: float = setting(
        1e-3,
        meaning="Share of a candidate's output difference that the estimated parameters must leave unabsorbed.",
    )
    min_remaining_share_linear: float = setting(1e-5, meaning="The same for a spring or a damper.")
    bootstrap_draws: int = setting(
        2000,
        minimum=100,
        meaning="Wild-bootstrap draws of the family-wise test.",
        provenance="conventional: p is resolved to 1/2000, a twentieth of the significance level",
    )
    significance_level: float = setting(
        0.01,
        minimum=1e-4,
        maximum=0.5,
        meaning="Family-wise level of the score test, and of the critical score behind the minimum detectable effects.",
        provenance="conventional: 1 %, as usual where a false alarm is costly",
    )
    structured_rho2: float = setting(
        0.01, meaning="Partial rho^2 of the best candidate from which a significant residual is worth a fit."
    )
    obvious_rho2: float = setting(
        0.20,
        meaning="Partial rho^2 from which no significance is asked for.",
        provenance="trial: ten times the rho^2 that noise of any colour reached",
    )
    noise_rho2: float = setting(
        0.02,
        meaning="Partial rho^2 up to which a residual counts as noise of unknown level and colour, whatever its p.",
        provenance="trial: the largest that noise of any colour reached in simulated campaigns",
    )
    estimation_gain_margin: float = setting(
        1.4,
        minimum=1.0,
        meaning="Margin on a minimum detectable effect by its gain on the estimation runs, not the validation runs.",
    )
    absorption_margin: float = setting(
        1.5,
        minimum=1.0,
        meaning="Margin on a minimum detectable effect by its predicted gain: a fit absorbs more than to first order.",
        provenance="trial: of 143 effects of this size 136 were found; with 2.0 135 of 139",
    )
    min_group_share: float = setting(
        0.5,
        maximum=1.0,
        meaning="Share of the squared residual beyond noise that differences within a group must explain.",
    )
    min_group_difference: float = setting(
        0.05,
        meaning="Deviation of a member of a group from their mean, in the common value, that is worth a parameter.",
        provenance="conventional: new springs and dampers of one kind differ by about as much",
    )


@dataclass(frozen=True)
class RefitSettings:
    """Candidate refit: which candidates are fitted, and when one is given up."""

    always_refitted: int = setting(5, minimum=1, meaning="Best candidates that are always fitted.")
    refit_share: float = setting(
        0.45,
        maximum=1.0,
        meaning="Share of the best partial rho^2 from which a further candidate is fitted.",
    )
    refit_share_memory: float = setting(
        0.1, maximum=1.0, meaning="The same for an effect with states of its own, whose score is less reliable."
    )
    max_refitted: int = setting(9, minimum=1, meaning="Candidates up to which further ones are fitted.")
    screening_duration: float = setting(
        18.0, unit="s", minimum=1.0, meaning="First part of every segment on which candidates are screened."
    )
    screened_shapes: int = setting(
        2, minimum=1, meaning="Shapes of a candidate, those with the best scores, from which its screening fits start."
    )
    screened_shapes_memory: int = setting(
        3, minimum=1, meaning="The same for an effect with states of its own, whose score is less reliable."
    )
    first_iterations: int = setting(2, minimum=1, meaning="Iterations of a screening fit from each of its starts.")
    further_iterations: int = setting(
        4, minimum=1, meaning="Further iterations of candidates that are not given up after the first."
    )
    slow_iterations: int = setting(10, minimum=1, meaning="The same for a candidate that converges slowly.")
    rig_iterations: int = setting(25, minimum=1, meaning="The same for a candidate on a rig, which costs little.")
    screening_tolerance: float = setting(
        1e-3, minimum=1e-9, meaning="Relative gain of the misfit in an iteration below which a screening fit ends."
    )
    refit_tolerance: float = setting(
        1e-3, minimum=1e-9, meaning="The same for the refit of a single candidate over whole runs."
    )
    comparison_tolerance: float = setting(
        3e-5, minimum=1e-9, meaning="The same where several candidates, or pairs, are compared by their misfits."
    )
    leading_candidates: int = setting(
        2, minimum=1, meaning="Candidates that are fitted further before others are given up against them."
    )
    give_up_ratio: float = setting(
        1.6, minimum=1.0, meaning="Misfit over the least misfit at which a candidate is given up after its first steps."
    )
    give_up_ratio_memory: float = setting(
        4.0, minimum=1.0, meaning="The same for an effect with states of its own, which converges slowly."
    )
    given_up_ratio: float = setting(
        1.05, minimum=1.0, meaning="Misfit over that of the leading refits from which another refit is given up."
    )
    converged_ratio: float = setting(
        1.25, minimum=1.0, meaning="Misfit over the least misfit up to which a screened candidate is fitted to its end."
    )
    settled_noise_ratio: float = setting(
        1.10, minimum=1.0, meaning="Error over noise on the screened part up to which nothing is left to explain."
    )
    screening_misfit_share: float = setting(
        0.01,
        maximum=1.0,
        meaning="Share of the misfit without effect that a screening fit may leave beyond noise.",
    )
    wrong_sign_start: float = setting(
        0.3, meaning="Amount from which a one-sided effect starts where its score has the wrong sign."
    )
    small_start: float = setting(0.3, meaning="Further start of a candidate, as a share of its estimated amount.")
    absorbed_start: float = setting(
        0.2, meaning="Start of a spring or damper fitted from the nominal model, as a share of its usual strength."
    )
    max_unabsorbed_share: float = setting(
        0.3,
        maximum=1.0,
        meaning="Share that the estimated parameters leave of its output difference, up to which it is fitted so.",
        provenance="trial: 0.18 at most on a simulated bogie, more than 0.3 on a coach but for one damper",
    )
    absorbed_misfit_ratio: float = setting(
        0.99, maximum=1.0, meaning="Misfit over the least misfit that such a spring or damper must reach."
    )
    cross_validation_folds: int = setting(
        5,
        minimum=2,
        meaning="Folds of the cross-validation behind the ranking.",
        provenance="conventional: five to ten folds (Hastie, Tibshirani, Friedman 2009, 7.10)",
    )
    ranking_draws: int = setting(200, minimum=20, meaning="Block-bootstrap draws behind the weights of the ranking.")


@dataclass(frozen=True)
class SelectionSettings:
    """Stepwise (forward-backward) selection of effects."""

    max_effects: int = setting(3, minimum=1, meaning="Effects that may be added.")
    adequate_ratio: float = setting(
        1.10,
        minimum=1.0,
        meaning="Error over noise floor up to which the model is adequate.",
        provenance="trial: blind simulation study, runs without an unmodelled effect",
    )
    unexplained_ratio: float = setting(
        1.5, minimum=1.0, meaning="Error over noise floor from which an unmodelled effect of any form is assumed."
    )
    absorbed_ratio: float = setting(
        1.3,
        minimum=1.0,
        meaning="Error over noise floor from which springs and dampers absorbed by estimation are tried.",
    )
    simpler_misfit_ratio: float = setting(
        1.02, minimum=1.0, meaning="Misfit over the best misfit up to which the law with fewer parameters is taken."
    )
    trial_misfit_share: float = setting(
        0.05,
        maximum=1.0,
        meaning="Share of the estimation misfit that an effect must take to be tried together with another.",
    )
    worthwhile_gain_share: float = setting(
        0.5,
        maximum=1.0,
        meaning="Share of the minimum gain that an effect must take of the estimation misfit, where that is less.",
    )
    gain_standard_errors: float = setting(
        1.0,
        meaning="Standard errors by which the gain on the validation runs must differ from zero.",
        provenance="conventional: one standard error (Hastie, Tibshirani, Friedman 2009, 7.10)",
    )
    decisive_misfit_ratio: float = setting(
        0.5,
        maximum=1.0,
        meaning="Misfit with an effect over that without it from which sensor noise does not count in the gain.",
    )
    decisive_standard_errors: float = setting(
        3.0,
        meaning="Standard errors by which the gain must then differ from zero, and where no score is significant.",
        provenance="conventional: three, since many candidates are tried",
    )
    runners_up: int = setting(
        3, minimum=0, meaning="Next candidates that are validated where the best one gains nothing on unseen runs."
    )
    exchanged_candidates: int = setting(
        3,
        minimum=0,
        meaning="Candidates with which an effect is compared again once others are in the model.",
    )
    pair_shapes: int = setting(
        40, minimum=2, meaning="Shapes of candidates of which all pairs are scored where single effects do not suffice."
    )
    pair_shapes_of_candidate: int = setting(3, minimum=1, meaning="Shapes of one candidate among these, at most.")
    refitted_pairs: int = setting(5, minimum=1, meaning="Best pairs that are fitted together.")
    hopeless_pair_ratio: float = setting(
        5.0,
        minimum=1.0,
        meaning="Misfit that a pair leaves after a few iterations, over that of the accepted effects, above which it is"
        " given up.",
        provenance="conventional: a few iterations leave most of the way to the minimum behind them",
    )
    min_pair_difference: float = setting(
        0.02,
        maximum=1.0,
        meaning="Squared sine of the angle between the output differences of two effects from which they form a pair.",
    )
    rival_share: float = setting(
        0.10, maximum=1.0, meaning="Share of the misfit that a drift or coupling must explain to rule out an effect."
    )
    rival_ratio: float = setting(1.05, minimum=1.0, meaning="Ratio by which it must explain more than the effect does.")
    indistinguishable_ratio: float = setting(
        1.10, minimum=1.0, meaning="Cross-validated error over the best up to which two laws are indistinguishable."
    )
    gain_forecast_duration: float = setting(
        12.0, unit="s", minimum=1.0, meaning="First part of every validation segment on which gains are predicted."
    )
