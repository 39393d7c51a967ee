# %% [markdown]
# # A film study
# Films from 0.1 to 0.3 mm: what changes as drawn, and what is left of it in print?

# %%
import sensorgen as sg

films = [0.1, 0.2, 0.3]
rows = []
for film in films:
    p = sg.predict(sg.Design(shape="tri", parameters={"dielectric_mm": film}))
    rows.append((film, p.drawn, p))
    print(
        f"{film:.1f} mm: gap {p.drawn.gap.value * 1e3:.1f} -> {p.gap.value * 1e3:.1f} mm, "
        f"C {p.drawn.capacitance.value * 1e12:.1f} -> {p.capacitance.value * 1e12:.1f} pF, "
        f"force known to {p.drawn.force_resolution.value:.2g} -> {p.force_resolution.value:.2g} N"
    )

# %% [markdown]
# The printed gap is a whole number of layers above the drawn one: the tips vanish.

# %%
assert all(p.gap.value >= drawn.gap.value for _, drawn, p in rows)

# %%
from matplotlib.figure import Figure

figure = Figure(figsize=(6, 3.5), layout="constrained")
axes = figure.subplots()
for label, values in (("drawn", [d for _, d, _ in rows]), ("printed", [p for _, _, p in rows])):
    c = [v.capacitance for v in values]
    errors = [[b.value - b.lower for b in c], [b.upper - b.value for b in c]]
    axes.errorbar(
        films, [b.value * 1e12 for b in c], [[e * 1e12 for e in side] for side in errors], fmt="o-", label=label
    )
axes.set_xlabel("film [mm]")
axes.set_ylabel("capacitance [pF]")
axes.legend()
figure
