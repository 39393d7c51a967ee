# %% [markdown]
# # Speed against accuracy
# The least expensive model within a tolerance is used; a prediction says which one, its error and its time.

# %%
import time

import sensorgen as sg

body = sg.as_printed(sg.Design(shape="tri", parameters={"dielectric_mm": 0.13}), walls="arachne")
for accuracy in (1e-2, 1e-3):
    begun = time.perf_counter()
    p = sg.predict(body, accuracy=accuracy, law="unconfined")
    level = p.plan.levels[0]
    print(
        f"{accuracy:g}: {level.chosen}, bounds of C {p.capacitance.model.width():.1g} wide, "
        f"{time.perf_counter() - begun:.2f} s"
    )

# %%
for level in p.plan.levels:
    for candidate in level.candidates:
        print(level.name, candidate.model, candidate.width, candidate.seconds, candidate.passed_over)
