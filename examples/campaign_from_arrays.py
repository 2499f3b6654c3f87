# ---
# jupyter:
#   jupytext: {text_representation: {extension: .py, format_name: percent}}
# ---

# %% [markdown]
# # A campaign from arrays to a verdict
#
# The runs are simulated: a bogie with a clearance in its primary suspension, which the nominal vehicle does not have, and sensor noise. The loop gets
# the nominal vehicle and the arrays only.

# %%
import numpy as np

import railui

nominal = railui.Design.load(railui.bundled("test_bogie.yaml"))
clearance = "effects: [{kind: free_play, at: primary_lateral, half_width: 0.6 mm}]\n"
truth = railui.Design.from_text(nominal.to_yaml() + clearance)
noise = {"e1": 5e-5, "e2": 5e-5, "ay1": 0.05, "ay2": 0.05, "ayf": 0.02, "d1": 2e-5, "d2": 2e-5}


def measure(seed: int) -> railui.Run:
    """Simulate a run of 40 s at 40 m/s and add sensor noise."""
    track = railui.Track.synthetic("erri_b176_high", length=1600.0, seed=seed, spacing=0.2)
    series = truth.simulate(track, 40.0, list(noise))
    random = np.random.default_rng(seed)
    noisy = {name: series[name] + sd * random.standard_normal(series["t"].size) for name, sd in noise.items()}
    track_columns = {name: series[name] for name in ("yw", "phiw", "gauge")}
    return railui.Run.from_arrays(t=series["t"], v=series["v"], **track_columns, **noisy, name=f"run {seed}")


runs = [measure(1), measure(2)]
runs[0]

# %% [markdown]
# The parameters to estimate are some stiffnesses and dampings; everything else keeps its nominal value.

# %%
campaign = railui.Campaign.from_runs(
    nominal,
    estimation=runs[0],
    validation=runs[1],
    noise=noise,
    name="simulated clearance",
    estimated_parameters=[
        "vehicle.primary.lateral_stiffness",
        "vehicle.primary.longitudinal_stiffness",
        "vehicle.secondary.lateral_damping",
    ],
)
assert not campaign.check()
print(campaign.summary())

# %% [markdown]
# ## Estimation alone
#
# The calibrated vehicle cannot follow: its error is far above that of noise, and the residual is correlated with the output of a clearance.

# %%
fit = campaign.adjust()
print(fit.summary())
print(fit.candidates[:3])

# %%
fit.residuals()[0].plot("d1")

# %% [markdown]
# ## The loop

# %%
loop = campaign.loop()
print(loop.sentence)
loop.plot_errors()

# %%
effect = loop.effects[0]
half_width = effect.parameters["half_width"]
print(f"{effect.kind} at {effect.at}: {1e6 * half_width.value:.1f} +/- {1e6 * (half_width.sd or 0.0):.1f} um")
assert (loop.verdict, effect.kind, effect.at) == ("effect", "free_play", "primary_lateral")
assert abs(half_width.value - 0.6e-3) < 0.03e-3

# %% [markdown]
# The calibrated vehicle is a design like any other, with the covariance of its parameters.

# %%
calibrated = loop.design
print(calibrated.ride("erri_b176_low length=1000 seed=5", 40.0).summary())
