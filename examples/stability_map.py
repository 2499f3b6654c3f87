# ---
# jupyter:
#   jupytext: {text_representation: {extension: .py, format_name: percent}}
# ---

# %% [markdown]
# # A stability map
#
# How much conicity and how much yaw damping the bogie bears: modes against speed, the linear critical speed over two parameters, the parameters
# that change it most, and the price in curves.

# %%
import numpy as np
from matplotlib import pyplot as plt

import railui

design = railui.Design.load(railui.bundled("test_bogie.yaml"))
stability = design.stability(np.arange(10.0, 91.0, 5.0))
print(stability.summary())

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3), layout="constrained")
stability.plot_damping(left)
stability.plot_frequency(right)

# %% [markdown]
# ## The map
#
# Each point is a vehicle of its own. Grey means that there is no critical speed up to 90 m/s.

# %%
critical = design.map(
    "contact.conicity=0.05:0.4:0.05",
    "vehicle.secondary.yaw_damping=10 kN*m*s/rad:110 kN*m*s/rad:20 kN*m*s/rad",
    ["linear_critical_speed"],
)
critical.plot("linear_critical_speed")
print(critical.summary())

# %%
speeds = critical.values("linear_critical_speed")
worn = critical.x > 0.2
print(f"at a conicity above 0.2 the critical speed is at most {np.nanmax(speeds[:, worn]):.1f} m/s")
assert np.nanmax(speeds[:, worn]) < np.nanmax(speeds), "worn wheels hunt earlier"

# %% [markdown]
# ## The parameters that matter
#
# Each goes from 5 % below to 5 % above its value, all others unchanged.

# %%
sensitivity = design.sensitivity(["linear_critical_speed"])
sensitivity.plot_changes("linear_critical_speed")
for one in sensitivity.largest("linear_critical_speed", 5):
    print(f"{one['path']:>45}: {one['relative']['linear_critical_speed']:+.2f} % per %")

# %% [markdown]
# ## The price in curves
#
# A stiffer guidance of the wheelsets hunts later and steers worse: the wear number in curves grows.

# %%
radii = np.arange(300.0, 1501.0, 100.0)
stiffer = design.with_values({"vehicle.primary.longitudinal_stiffness": "20 MN/m"})
ax = design.curve(radii, 0.1).plot_wear()
stiffer.curve(radii, 0.1).plot_wear(ax).lines[-1].set_linestyle("--")
ax.legend(["design", "stiffer primary suspension"])
wear = [vehicle.curve(400.0, 0.1).cases[0]["wear_number"] for vehicle in (design, stiffer)]
print(f"wear number at 400 m: {wear[0]:.0f} N, with the stiffer suspension {wear[1]:.0f} N")
