"""Settings of the noise model: weights of stated and estimated noise."""

from __future__ import annotations

from dataclasses import dataclass

from railui.campaign.settings.declaration import setting


@dataclass(frozen=True)
class NoiseSettings:
    """Noise of the columns, with the stated noise as a log-normal prior."""

    stated_noise_factor: float = setting(
        2.0,
        minimum=1.01,
        meaning="Factor that one standard deviation of the log-normal prior about a stated noise spans.",
    )
    quiet_noise_factor: float = setting(
        1.3, minimum=1.01, meaning="The same of a white noise level from the top of a channel's spectrum, at least."
    )
    relation_noise_factor: float = setting(
        1.05, minimum=1.001, meaning="The same of a level from kinematic relations between channels, at least."
    )
    undetermined_noise_factor: float = setting(
        2.0, minimum=1.01, meaning="The same from which a level counts as not determined by the data."
    )
