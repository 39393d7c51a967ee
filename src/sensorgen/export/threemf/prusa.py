"""3MF for PrusaSlicer: one object, one mesh, and who prints which triangles.

PrusaSlicer pays no heed to ``basematerials``; tested with 2.5.0, bodies meant for several tools all went
to the first. What it heeds is ``Metadata/Slic3r_PE_model.config``: ranges of triangles, each a *volume*
with its tool, counted from 1, and settings of its own. The object there and the one in the model share
their id. ``slic3rpe:Version3mf`` marks the file as of this format, so that the names in it are kept.

It is silent about mistakes: a tool that the printer lacks becomes the first, and a setting that it does
not know is dropped (both seen in 2.5.0). Who knows the printer must check before.

Placement: ``centre_mm`` is in bed coordinates, those of ``bed_shape`` and of the G-code. For a bed whose
origin is its centre that is (0, 0). The slicer keeps it with ``--dont-arrange`` only.

Since 2.9 the place of the prime tower is no setting: it is in ``TOWER``, which older versions ignore.

Reader: prusa3d/PrusaSlicer, ``src/libslic3r/Format/3mf.cpp``.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from sensorgen.design.tower import Tower
from sensorgen.export.threemf import core
from sensorgen.export.threemf.part import Part, escaped

CONFIG = "Metadata/Slic3r_PE_model.config"
TOWER = "Metadata/Prusa_Slicer_wipe_tower_information.xml"

_NAMESPACE = {"slic3rpe": "http://schemas.slic3r.org/3mf/2017/06"}
_VERSION = {"slic3rpe:Version3mf": "1"}


def files(title: str, parts: Sequence[Part], shift_mm: NDArray[np.float64]) -> Iterator[tuple[str, Iterator[str]]]:
    """Path and text of each file; ``shift_mm`` leads from sensor to bed coordinates [mm]."""
    yield core.MODEL, core.model(title, _VERSION, _NAMESPACE, parts, _object(title, parts), shift_mm)
    yield CONFIG, _config(title, parts)


def tower(place: Tower) -> tuple[str, Iterator[str]]:
    """Path and text of the file that says where the prime tower stands."""
    where = f'bed_idx="0" position_x="{place.x_mm:.9g}" position_y="{place.y_mm:.9g}" rotation_deg="0"'
    return TOWER, iter([f'<?xml version="1.0" encoding="UTF-8"?>\n<wipe_tower_information {where}/>\n'])


def _object(title: str, parts: Sequence[Part]) -> Iterator[str]:
    name = f'"{escaped(title)}"'
    yield f'<object id="{core.OBJECT_ID}" type="model" name={name}{core.material(parts[0], parts)}>\n'
    yield from core.mesh(parts, [core.material(part, parts, "p1") for part in parts])
    yield "</object>\n"


def _config(title: str, parts: Sequence[Part]) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8"?>\n<config>\n'
    yield f'<object id="{core.OBJECT_ID}" instances_count="1">\n{_metadata("object", "name", title)}'
    first = 0
    for part in parts:
        end = first + len(part.mesh.triangles)
        yield f'<volume firstid="{first}" lastid="{end - 1}">\n'
        own = {"name": part.name, "volume_type": "ModelPart", "extruder": str(part.extruder + 1)}
        entries = dict(sorted(part.settings.items())) | own  # settings cannot take a body to another tool
        yield from (_metadata("volume", key, value) for key, value in entries.items())
        yield "</volume>\n"
        first = end
    yield "</object>\n</config>\n"


def _metadata(kind: str, key: str, value: str) -> str:
    return f'<metadata type="{kind}" key="{escaped(key)}" value="{escaped(value)}"/>\n'
