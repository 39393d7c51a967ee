"""Bodies to multi-material 3MF: the same bodies in one file per family of slicers.

No slicer takes its tools from the 3MF standard, and each family keeps them elsewhere: see ``prusa``,
``cura`` and ``orca``. Every file is valid 3MF, too, with named bodies and coloured materials, so
that any viewer shows it. Bodies are in the order of their names.
"""

from collections.abc import Sequence

import numpy as np

from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.design.printer import Tower
from sensorgen.export.threemf import core, cura, orca, prusa
from sensorgen.export.threemf.core import Part, box_mm, check, placed

__all__ = ["FAMILIES", "Part", "content", "placed", "plate"]

_WRITERS = {"prusa": prusa.files, "cura": cura.files, "orca": orca.files}

FAMILIES = tuple(_WRITERS)


def content(
    family: str, title: str, parts: Sequence[Part], centre_mm: tuple[float, float], tower: Tower | None = None,
    profile: str = "",
) -> bytes:  # fmt: skip
    """The 3MF of some bodies for one family of slicers.

    Parameters
    ----------
    family : str
        One of ``FAMILIES``: ``prusa``, ``cura``, ``orca``.
    title : str
        Name of the print, shown by viewers and slicers.
    parts : sequence of Part
        The bodies, in any order.
    centre_mm : (float, float)
        Where the middle of the sensor (of the box around all bodies) goes on the bed [mm], in the
        family's coordinates: of the bed for ``prusa`` and ``orca``, from its front left corner for
        ``cura``. The lowest point comes to stand on the bed.
    tower : Tower, optional
        The prime tower, in coordinates of the bed; PrusaSlicer reads its place here since 2.9.
    profile : str
        Text of an ``.ini`` that PrusaSlicer's window opens with the bodies; for ``prusa`` alone.

    Returns
    -------
    bytes
        The whole file. The same arguments give the same bytes.

    Raises
    ------
    UnknownName
        No such family.
    BadInput, OutOfRange
        See ``part.check``.

    Examples
    --------
    >>> from sensorgen.scene.geometry.meshes import Mesh
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    >>> sides = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], dtype=np.int32)
    >>> film = Part("film", "X60", "#cccccc", 1, Mesh(corners, sides))
    >>> content("prusa", "tetrahedron", [film], (0.0, 0.0))[:2]
    b'PK'
    """
    if family not in _WRITERS:
        raise UnknownName("family of slicers", family, FAMILIES)
    check(title, parts, centre_mm)
    ordered = sorted(parts, key=lambda part: part.name)
    low, high = box_mm(parts)
    shift_mm = np.array([*centre_mm, 0.0]) - [*(low + high)[:2] / 2, low[2]]
    files = list(_WRITERS[family](title, ordered, shift_mm))
    if family == "prusa":
        files += [prusa.tower(tower)] if tower else []
        files += [prusa.profile(profile)] if profile else []
    return core.pack(files)


def plate(
    family: str, title: str, parts: Sequence[Part], corner_mm: tuple[float, float], tower: Tower | None = None,
    profile: str = "",
) -> bytes:  # fmt: skip
    """The 3MF of a plate with several sensors, each body where it stands.

    Parameters
    ----------
    family : str
        One of ``FAMILIES``.
    title : str
        Name of the print.
    parts : sequence of Part
        All bodies, made by :func:`placed` in the coordinates of the bed.
    corner_mm : (float, float)
        The front left corner of the bed in those coordinates [mm]: Cura counts from there.
    tower, profile : Tower, str
        See :func:`content`.

    Raises
    ------
    UnknownName, BadInput, OutOfRange
        See :func:`content`.
    """
    if not parts:
        raise BadInput("no bodies to write: a plate needs at least one sensor")
    low, high = box_mm(parts)
    middle_x, middle_y = (low + high)[:2] / 2
    x0, y0 = corner_mm if family == "cura" else (0.0, 0.0)
    return content(family, title, parts, (float(middle_x - x0), float(middle_y - y0)), tower, profile)
