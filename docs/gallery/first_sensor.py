# %% [markdown]
# # A first sensor
# A triangular sensor with a film of 0.2 mm: will it print, and what will it measure?

# %%
import sensorgen as sg

design = sg.Design(shape="tri", parameters={"dielectric_mm": 0.2})
design.show()  # section with layers and findings

# %% [markdown]
# Tips narrower than a line vanish in the slicer.

# %%
found = sg.check(design)
found.counts()

# %% [markdown]
# The print beside the drawing. Every range holds the errors of models, print and material values.

# %%
prediction = sg.predict(design)
print(f"gap drawn {prediction.drawn.gap.value * 1e3:g} mm, printed {prediction.gap.value * 1e3:g} mm")
print(f"capacitance {prediction.capacitance.value * 1e12:.1f} pF")
prediction

# %%
prediction.plot()

# %% [markdown]
# How well can it tell force and position from one reading: after 30 known presses, and if it were exactly as predicted?

# %%
print(prediction.resolved())
print(prediction.identifiability.verdict)
