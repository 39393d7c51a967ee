# %% [markdown]
# # A film study
# Films from 0.1 to 0.3 mm: what changes as drawn, and what is left of it in print?

# %%
import sensorgen as sg

films = [0.1, 0.2, 0.3]
predictions = [sg.predict(sg.Design(shape="tri", parameters={"dielectric_mm": film})) for film in films]
for film, p in zip(films, predictions, strict=True):
    print(
        f"{film:.1f} mm: gap {p.drawn.gap.value * 1e3:.1f} -> {p.gap.value * 1e3:.1f} mm, "
        f"C {p.drawn.capacitance.value * 1e12:.1f} -> {p.capacitance.value * 1e12:.1f} pF, "
        f"force after 30 known presses to {p.drawn.resolved()[0]} -> {p.resolved()[0]}"
    )

# %% [markdown]
# The printed gap is a whole number of layers above the drawn one: the tips vanish.

# %%
assert all(p.gap.value >= p.drawn.gap.value for p in predictions)

# %%
predictions[-1].plot()
