# ---
# jupyter:
#   jupytext: {text_representation: {extension: .py, format_name: percent}}
# ---

# %% [markdown]
# # An optimisation with the calibrated model
#
# The nominal model of a bogie lacks a clearance, which a (simulated) campaign reveals. Suspensions are optimised for the nominal and for the
# calibrated vehicle, and both optima are run on the true one.

# %%
import numpy as np

import railui

nominal = railui.Design.load(railui.bundled("test_bogie.yaml"))
clearance = "effects: [{kind: free_play, at: secondary_lateral, half_width: 0.8 mm}]\n"
truth = railui.Design.from_text(nominal.to_yaml() + clearance)
noise = {"e1": 5e-5, "e2": 5e-5, "ay1": 0.05, "ay2": 0.05, "ayf": 0.02, "d1": 2e-5, "d2": 2e-5}


def measure(seed: int) -> railui.Run:
    """Simulate a run of 30 s at 40 m/s and add sensor noise."""
    track = railui.Track.synthetic("erri_b176_high", length=1200.0, seed=seed, spacing=0.2)
    series = truth.simulate(track, 40.0, list(noise))
    random = np.random.default_rng(seed)
    noisy = {name: series[name] + sd * random.standard_normal(series["t"].size) for name, sd in noise.items()}
    track_columns = {name: series[name] for name in ("yw", "phiw", "gauge")}
    return railui.Run.from_arrays(t=series["t"], v=series["v"], **track_columns, **noisy, name=f"run {seed}")


# %% [markdown]
# ## The calibrated vehicle

# %%
campaign = railui.Campaign.from_runs(
    nominal,
    estimation=measure(1),
    validation=measure(2),
    noise=noise,
    name="simulated clearance",
    estimated_parameters=["vehicle.secondary.lateral_stiffness", "vehicle.secondary.lateral_damping"],
)
loop = campaign.loop()
print(loop.sentence)
calibrated = loop.design
assert [effect.kind for effect in calibrated.effects] == ["free_play"]

# %% [markdown]
# ## Two searches
#
# The same study, once for each vehicle: comfort against the clearance to the flange.

# %%
TRACK = "erri_b176_low length=400"


def search(vehicle: railui.Design) -> railui.Optimisation:
    """Search the stiffnesses of the primary suspension for comfort and guidance."""
    study = railui.Study.build(
        vehicle,
        {
            "vehicle.primary.lateral_stiffness": ("1 MN/m", "8 MN/m"),
            "vehicle.primary.longitudinal_stiffness": ("3 MN/m", "20 MN/m"),
        },
        [{"minimise": "weighted_acceleration", "over": "mean"}, {"maximise": "flange_margin", "over": "worst"}],
        track=TRACK,
        speed=40.0,
        method={"kind": "nsga2", "population": 12, "generations": 5},
    )
    return study.optimise()


found = {"nominal": search(nominal), "calibrated": search(calibrated)}
print(found["calibrated"].summary())

# %%
ax = found["calibrated"].plot_front()

# %% [markdown]
# ## Both optima on the true vehicle
#
# The comfort that each model predicts for its optimum, and that of the true vehicle, on a track that no search used.

# %%
unseen = railui.Track.synthetic("erri_b176_low", length=1000.0, seed=9)
error = {}
for name, vehicle in (("nominal", nominal), ("calibrated", calibrated)):
    best = min(found[name].front, key=lambda one: one.objectives[0])
    predicted, true = (
        one.with_values(dict(best.variables)).ride(unseen, 40.0).weighted_acceleration for one in (vehicle, truth)
    )
    error[name] = abs(predicted / true - 1.0)
    print(f"optimum of the {name} vehicle: {predicted:.4f} m/s^2 predicted, {true:.4f} m/s^2 of the true vehicle")
assert error["calibrated"] < error["nominal"]
