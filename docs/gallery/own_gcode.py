# %% [markdown]
# # Your own G-code
# What a slicer prints, from its G-code. Without a slicer the estimate is used.

# %%
import shutil
import tempfile

import sensorgen as sg

design = sg.Design(shape="tri", parameters={"length_mm": 20.0, "dielectric_mm": 0.2})
if shutil.which("prusa-slicer"):
    folder = tempfile.mkdtemp()
    sliced = sg.slice_design(design, folder)
    body = sg.as_printed(design, sliced.gcode)
else:
    body = sg.as_printed(design)
body.provenance

# %%
prediction = sg.predict(body)
prediction

# %% [markdown]
# The estimate holds the rules of several slicers; the file is one of them.

# %%
estimate = sg.predict(sg.as_printed(design))
print(estimate.capacitance.print, prediction.capacitance.value)
