# %% [markdown]
# # From readings to a comparison
# Store the prediction, log what the multimeter says, and compare.

# %%
import tempfile
from pathlib import Path

import sensorgen as sg
from sensorgen.measure.log import notes
from sensorgen.measure.log.prints import predict

folder = Path(tempfile.mkdtemp())
with sg.Log(folder / "log.db", create=True) as log:
    predict(log, "23 triX .2mm 1")  # before measuring
    log.add([notes.reading("23 triX .2mm 1", "2.1k", "OL")])  # along an electrode; between the electrodes
    comparison = sg.compare(log, 23)

# %%
row = comparison.rows[0]
print(row.predicted.provenance)
print(row.predicted.ry_ohm, row.verdict.ry_ohm)
