"""3MF for Cura: one object per body, grouped, each with its tool in its metadata.

Cura's reader makes a scene node of each object and takes those of one ``<components>`` as a group, which
keeps the bodies together (a lone body stands without group, about the origin). From an object's
``<metadatagroup>`` it takes every entry of the namespace ``cura``: ``cura:extruder_nr``, counted from 0,
chooses the tool, any other name a setting of this body alone (``SETTINGS`` below). The materials are for
other viewers; Cura reads none.

Placement: ``centre_mm`` counts from the *front left corner* of the bed. Cura subtracts half of
``machine_width`` and half of ``machine_depth`` from what it reads, also where ``machine_center_is_zero``
is set, so the middle of a 390 x 170 mm bed is (195, 85) here though it is (0, 0) in the G-code.

CuraEngine's command line reads no 3MF. Tried with the reader and the libSavitar of Cura 4.13; not with
a window. Reader: Ultimaker/Cura, ``plugins/3MFReader/ThreeMFReader.py``; Ultimaker/libSavitar, ``Scene.cpp``.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sensorgen.export.threemf import core
from sensorgen.export.threemf.core import Part, escaped

# PrusaSlicer's name of a setting to Cura's, where both mean the same.
SETTINGS = {
    "fill_density": "infill_sparse_density",
    "perimeters": "wall_line_count",
    "top_solid_layers": "top_layers",
    "bottom_solid_layers": "bottom_layers",
}

_NAMESPACE = {"cura": "http://software.ultimaker.com/xml/cura/3mf/2015/10"}


def files(title: str, parts: Sequence[Part], shift_mm: NDArray[np.float64]) -> Iterator[tuple[str, Iterator[str]]]:
    """Path and text of each file; ``shift_mm`` leads from sensor to bed coordinates [mm]."""
    if len(parts) > 1:
        objects = core.bodies(title, parts, _group)
    else:  # Cura makes no group of one: it shifts a lone mesh by the middle of its box a second time
        vertices_mm = parts[0].mesh.vertices_mm
        middle = (vertices_mm.min(axis=0) + vertices_mm.max(axis=0)) / 2
        alone = replace(parts[0], mesh=replace(parts[0].mesh, vertices_mm=vertices_mm - middle))
        parts, shift_mm = [alone], shift_mm + middle
        objects = core.body(core.OBJECT_ID, alone, parts, _group(alone))
    yield core.MODEL, core.model(title, {}, _NAMESPACE, parts, objects, shift_mm)


def _group(part: Part) -> str:
    known = sorted((SETTINGS[key], value) for key, value in part.settings.items() if key in SETTINGS)
    entries = {"extruder_nr": str(part.extruder)} | {key: value.removesuffix("%") for key, value in known}
    lines = (f'<metadata name="cura:{escaped(key)}">{escaped(v)}</metadata>\n' for key, v in entries.items())
    return f"<metadatagroup>\n{''.join(lines)}</metadatagroup>\n"
