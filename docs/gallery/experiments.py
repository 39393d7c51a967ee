# %% [markdown]
# # Nine designs over film and period
# How film and period of a triangular sensor decide its capacitance, as printed.

# %%
import sensorgen as sg

design = sg.Design(shape="tri", parameters={"length_mm": 60.0})
films, periods = [0.1, 0.2, 0.4], [4.0, 6.0, 10.0]
found = sg.sweep(design, unloaded=True, dielectric_mm=films, period_mm=periods)
found.plot()

# %%
found

# %% [markdown]
# Without `unloaded` every design is pressed, too, which takes minutes: the table then has sensitivity and resolution.
# With pandas the table can be turned.

# %%
found.to_pandas().pivot(index="dielectric_mm", columns="period_mm", values="lower_f_per_m2")
