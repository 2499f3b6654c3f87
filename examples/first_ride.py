# ---
# jupyter:
#   jupytext: {text_representation: {extension: .py, format_name: percent}}
# ---

# %% [markdown]
# # First ride
#
# A bogie on a synthetic track: ride quality, time series, stability, and a stiffer suspension. Numbers are SI, or carry a unit as text.

# %%
import numpy as np
from matplotlib import pyplot as plt

import railui

design = railui.Design.load(railui.bundled("test_bogie.yaml"))
track = railui.Track.synthetic("erri_b176_low", length=1000.0, seed=1)
ride = design.ride(track, "144 km/h")
ride  # in a notebook: the summary as a table

# %%
print(ride.summary())

# %% [markdown]
# ## Figures
#
# Every `plot` takes axes of matplotlib and returns them.

# %%
figure, (top, bottom) = plt.subplots(2, 1, figsize=(8, 5), layout="constrained")
ride.plot_displacement(top)
ride.plot_spectrum(bottom)

# %% [markdown]
# ## Series as arrays
#
# The channels are arrays with a common time. The standard deviation of the displacement of the leading wheelset:

# %%
series = ride.series(["e1", "ayf"])
print(f"sd of e1: {1e3 * np.std(series['e1']):.3f} mm, {series.rate:.0f} samples per second, unit {series.units['e1']}")
assert np.isclose(np.std(series["e1"]), ride.data["statistics"]["sd_e"][0], rtol=0.02)

# %% [markdown]
# ## Stability
#
# The modes of the linear vehicle against speed; the critical speed is that at which the damping of one vanishes.

# %%
stability = design.stability(np.arange(10.0, 91.0, 5.0))
stability.plot_damping()
print(stability.summary())

# %% [markdown]
# ## A map of the critical speed
#
# Over the conicity of the wheels and the yaw damping of the secondary suspension.

# %%
result = railui.response_map(
    design,
    "contact.conicity=0.1:0.4:0.1",
    "vehicle.secondary.yaw_damping=10 kN*m*s/rad:110 kN*m*s/rad:50 kN*m*s/rad",
    ["linear_critical_speed"],
)
speeds = np.array(result["of"]["linear_critical_speed"]["values"], dtype=float)
print(np.round(speeds, 1))
assert np.all(np.diff(speeds, axis=1)[np.isfinite(np.diff(speeds, axis=1))] < 0), "worn wheels hunt earlier"

# %% [markdown]
# ## Another suspension
#
# The same ride with a changed number; the design itself is unchanged. Comfort of a bogie without a carbody does not follow its secondary
# suspension (a note of the ride), so a spring of the primary suspension is changed.

# %%
for stiffness in ("2 MN/m", "3 MN/m", "6 MN/m"):
    changed = design.with_values({"vehicle.primary.lateral_stiffness": stiffness})
    other = changed.ride(track, "144 km/h")
    print(f"{stiffness:>10}: {other.weighted_acceleration:.4f} m/s^2, {other.ride_class}, {other.decided_by}")
