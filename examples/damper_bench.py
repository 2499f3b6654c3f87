# ---
# jupyter:
#   jupytext: {text_representation: {extension: .py, format_name: percent}}
# ---

# %% [markdown]
# # A damper on a bench
#
# **Measured** data: a magneto-rheological damper on a press, moved by sines at a coil current of 1 A. The bundled recordings are read as arrays, a linear
# damper is fitted, and the laws of the catalogue that could explain the rest of the force are ranked. The whole search is the command
# `railui loop designs/campaigns/mr_damper`.

# %%
from matplotlib import pyplot as plt

import railui

BENCH = railui.bundled("campaigns/mr_damper")
runs = {name: railui.Run.load(BENCH / f"{name}.csv.gz") for name in ("25mm_0.25Hz_1A", "5mm_3Hz_1A", "25mm_0.5Hz_1A")}
runs["25mm_0.25Hz_1A"]

# %% [markdown]
# ## Force against speed
#
# The loop of the branches is hysteresis; the step at low speed is friction. Neither is a linear damper.

# %%
figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
for name, run in runs.items():
    ax.plot(run.columns["vz"], run.columns["F"], lw=0.7, label=name)
ax.set_xlabel(f"speed [{runs['5mm_3Hz_1A'].column_units['vz']}]")
ax.set_ylabel(f"force [{runs['5mm_3Hz_1A'].column_units['F']}]")
ax.legend(frameon=False, fontsize=8)

# %% [markdown]
# ## A linear damper
#
# F = k z + c z' + preload, by least squares on both estimation runs.

# %%
campaign = railui.Campaign.from_runs(
    railui.Design.load(f"{BENCH}/vehicle.yaml"),
    estimation=[runs["25mm_0.25Hz_1A"], runs["5mm_3Hz_1A"]],
    validation=runs["25mm_0.5Hz_1A"],
    name="damper at 1 A",
)
fit = campaign.adjust()
print(fit.summary())

# %% [markdown]
# ## The residual
#
# The linear damper leaves a large share of the force on a run that it was not fitted to.

# %%
residual = fit.residuals("validation")[0]
residual.plot("F")
print(f"NRMSE on {residual.file.rpartition('/')[2]}: {residual.nrmse['F']:.3f}")
assert residual.nrmse["F"] > 0.2

# %% [markdown]
# ## Candidate laws
#
# The score test correlates the residual with the output of a small amount of each law.

# %%
for candidate in fit.candidates[:4]:
    print(candidate)
kinds = {candidate.kind for candidate in fit.candidates[:4]}
assert kinds & {"dry_friction", "hysteresis", "maxwell_damper", "free_play"}, kinds
