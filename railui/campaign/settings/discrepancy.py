"""Settings of discrepancies outside the library: drifts, force curves and run-to-run variation."""

from __future__ import annotations

from dataclasses import dataclass

from railui.campaign.settings.declaration import setting


@dataclass(frozen=True)
class DriftSettings:
    """Parameters that change along the track, or on a driven rig with time."""

    blocks_per_knot: float = setting(1.3, minimum=1.0, meaning="Blocks of time that each knot of a drift needs.")
    finer_drift_share: float = setting(
        0.02,
        maximum=1.0,
        meaning="Share of the misfit that more knots must explain beyond fewer.",
    )
    max_drift_knots: int = setting(33, minimum=3, meaning="Knots of the finest drift that is compared.")
    min_knot_spacing: float = setting(
        5.0,
        minimum=0.0,
        meaning="Distance of the knots of a drift with time over the time constant of the rig's slowest free motion.",
        provenance="trial: with the true values the blend of rigs of constant stiffness leaves 0.05 of the motion at "
        "12 time constants, 0.31 at 3",
    )
    drift_iterations: int = setting(4, minimum=1, meaning="Gauss-Newton iterations that refine a drift.")
    max_drift: float = setting(0.9, maximum=0.999, meaning="Share of its value that a parameter may lose by a drift.")
    drift_draws: int = setting(
        40, minimum=10, meaning="Random-sign draws behind the share of a drift that chance explains."
    )


@dataclass(frozen=True)
class DiscrepancySettings:
    """Localisation of a discrepancy that is not in the library."""

    noise_floor_excess_share: float = setting(
        1 / 3,
        maximum=1.0,
        meaning="Share of the excess over the noise floor up to which the estimation runs count as explained.",
    )
    min_drift_share: float = setting(0.02, maximum=1.0, meaning="Share of the misfit from which a drift is refined.")
    reliable_share: float = setting(
        0.5,
        maximum=1.0,
        meaning="Share of the misfit from which a curve, drift or coupling locates reliably.",
    )
    force_location_tolerance: float = setting(
        0.03, maximum=1.0, meaning="Share by which a location with fewer independent forces may explain less."
    )
    max_chance_share: float = setting(
        0.5,
        maximum=1.0,
        meaning="Independent forces over channels, the share of any residual that they explain, above which they locate"
        " nothing.",
        provenance="conventional: at least as many channels are left to contradict as the forces take",
    )
    location_noise_draws: int = setting(
        4, minimum=1, meaning="Noise realisations that are subtracted from the spectra behind a location."
    )
    condition_level: float = setting(
        0.01,
        maximum=1.0,
        meaning="Family-wise level below which a parameter depends on the stated condition of the runs.",
        provenance="conventional: one false dependence in a hundred campaigns",
    )
    min_condition_share: float = setting(
        0.5,
        maximum=1.0,
        meaning="Share of the squared error beyond noise that parameters estimated apart for every stated condition"
        " must remove for the verdict to be that on the model with these.",
        provenance="conventional: more than the conditions leave; 0.99 where one parameter depends on them",
    )
    fitted_curves: int = setting(
        2, minimum=1, meaning="Force curves, those that explain most, that are fitted together with all parameters."
    )
    curve_span: float = setting(
        2.5, minimum=0.5, meaning="Half-width of a force curve in standard deviations of the motion."
    )
    curve_points: int = setting(9, minimum=3, meaning="Points of a force curve.")
    curve_smoothness: float = setting(3e-3, meaning="Penalty on the second differences of a force curve.")


@dataclass(frozen=True)
class RunDependenceSettings:
    """Parameters that differ from run to run."""

    run_dependence_level: float = setting(
        0.01,
        minimum=1e-4,
        maximum=0.5,
        meaning="Family-wise level of the test whether a parameter differs from run to run.",
        provenance="conventional: 1 %, as the score test",
    )
    min_run_dependence_share: float = setting(
        0.9,
        maximum=1.0,
        meaning="Share of the squared error beyond noise from which separate values of a parameter are the difference"
        " between runs.",
        provenance="conventional: nine tenths, as for effects",
    )


@dataclass(frozen=True)
class CoefficientSettings:
    """Coefficients of the wheelset equations."""

    contradiction_sd: float = setting(
        4.0, meaning="Standard deviations from which a coefficient contradicts its derivation."
    )
    pulse_duration: float = setting(6.0, unit="s", minimum=1.0, meaning="Length of a pulse response.")
