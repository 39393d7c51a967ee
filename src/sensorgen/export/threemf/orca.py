"""3MF for OrcaSlicer and Bambu Studio: one object of parts, and who prints which part.

Written from the sources of their reader; neither program could be run here, so this is **untried**.

The reader takes ``Metadata/model_settings.config`` from any 3MF, whoever wrote it: an ``<object>`` with the
id of the built object, in it a ``<part>`` with the id of each component's object, and in that the
``extruder``, counted from 1. If the whole has one part only, the object's own ``extruder`` counts, so it is
given too. A file without the slicer's project settings (printer, filaments) opens as geometry only; names
and extruders survive this, other settings of a part do not, so none are written. The slicer must have as
many filaments set up as there are tools; importing (rather than opening) the file adds missing ones.

``BambuStudio:3mfVersion`` is what releases of 2022 and 2023 know their own files by; they would otherwise
bake the placement into the first part only, and the parts would come asunder. Later releases go by an
``Application`` that starts with ``BambuStudio-`` or ``OrcaSlicer-``. We claim neither: it changes no
extruder. Bambu Studio from 2.5 on may then offer to match the file's colours to filaments: decline.

Placement: ``centre_mm`` is in bed coordinates of the first plate, those of ``printable_area``.

Reader: SoftFever/OrcaSlicer and bambulab/BambuStudio, ``src/libslic3r/Format/bbs_3mf.cpp``.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from sensorgen.export.threemf import core
from sensorgen.export.threemf.core import Part, escaped

CONFIG = "Metadata/model_settings.config"

_NAMESPACE = {"BambuStudio": "http://schemas.bambulab.com/package/2021"}
_VERSION = {"BambuStudio:3mfVersion": "1"}


def files(title: str, parts: Sequence[Part], shift_mm: NDArray[np.float64]) -> Iterator[tuple[str, Iterator[str]]]:
    """Path and text of each file; ``shift_mm`` leads from sensor to bed coordinates [mm]."""
    yield core.MODEL, core.model(title, _VERSION, _NAMESPACE, parts, core.bodies(title, parts), shift_mm)
    yield CONFIG, _config(title, parts)


def _config(title: str, parts: Sequence[Part]) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8"?>\n<config>\n'
    yield f'<object id="{core.OBJECT_ID}">\n{_metadata(title, parts[0].extruder)}'
    for place, part in enumerate(parts):
        yield f'<part id="{core.body_id(place)}" subtype="normal_part">\n'
        yield f"{_metadata(part.name, part.extruder)}</part>\n"
    yield "</object>\n</config>\n"


def _metadata(name: str, extruder: int) -> str:
    return f'<metadata key="name" value="{escaped(name)}"/>\n<metadata key="extruder" value="{extruder + 1}"/>\n'
