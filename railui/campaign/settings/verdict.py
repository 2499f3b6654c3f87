"""Settings of the verdict: what the added effects must explain, and the evidence for a location and against noise."""

from __future__ import annotations

from dataclasses import dataclass

from railui.campaign.settings.declaration import setting


@dataclass(frozen=True)
class VerdictSettings:
    """Verdict: what the added effects must explain, and the evidence that a location needs."""

    min_explained_share: float = setting(
        0.9,
        maximum=1.0,
        meaning="Share of the squared error beyond noise from which the added effects are the explanation.",
        provenance="conventional: nine tenths; below, the verdict is partial where a structure is left",
    )
    max_noise_ratio: float = setting(
        10.0,
        minimum=1.0,
        meaning="NRMSE over the noise floor up to which an unstructured residual of a model with effects is noise.",
    )
    min_location_share: float = setting(
        0.3,
        maximum=1.0,
        meaning="Share of the squared residual beyond noise that a force must explain for its location to be named.",
    )
    min_location_excess: float = setting(
        0.1,
        maximum=1.0,
        meaning="Share that a force on the vehicle must explain beyond forces at the contact, as track noise has.",
    )
    location_standard_errors: float = setting(
        2.0,
        meaning="Standard errors by which that share must exceed zero.",
        provenance="conventional: two standard errors, some 95 % two-sided",
    )
    max_location_share: float = setting(
        1.1,
        minimum=1.0,
        meaning="Share above which forces name no location: more is explained than there is, since the noise was"
        " misjudged.",
        provenance="trial: at most 1.00 where forces act there, 1.7 and 1.9 in residuals of noise alone",
    )
    max_locations: int = setting(
        3,
        minimum=1,
        meaning="Locations at which forces explain a residual equally well that are stated; of more, none.",
    )
    min_coherent_share: float = setting(
        0.1,
        maximum=1.0,
        meaning="Share of the residual, coherent with the track or a motion beyond chance, from which it is no noise.",
    )
    min_vibration_share: float = setting(
        0.3,
        maximum=1.0,
        meaning="Share of a rig's residual about one frequency, beyond a smooth spectrum, from which it is no noise.",
        provenance="trial: at most 0.17 in 300 records of 1/f noise, 0.06 of white noise; 0.45 to 1 with a second mode "
        "or a stiffness that varies in time",
    )
    max_input_noise_share: float = setting(
        0.03,
        maximum=1.0,
        meaning="Noise of the measured input of a rig, over this input about the frequency of a vibration of the "
        "residual, up to which it may explain that vibration.",
        provenance="trial: 0.01 with 1.5 % of white noise on a force; 0.09 to 1.6 where stiffness or damping varies "
        "with time, or a second mode is left",
    )
    min_surface_share: float = setting(
        0.5,
        maximum=1.0,
        meaning="Share of a component's residual force on the validation runs that a surface over displacement and "
        "velocity explains beyond a function of each, from which it is no noise.",
        provenance="trial: 0.88 of friction that grows with the deflection; at most 0.25 of forces with memory and of "
        "coefficients that drift, on sweeps and sums of sines",
    )
    coherence_standard_errors: float = setting(
        3.0,
        meaning="Standard errors by which that share must exceed zero.",
        provenance="conventional: three, for the largest of some sixteen shares",
    )
