"""Expected width and run time of the capacitance models, from benchmark data scaled to the scene.

The measurements are ``models/expected.yaml``, all of them, made by ``bench/expected.py``.
"""

from collections.abc import Callable
from functools import cache, lru_cache
from importlib import resources
from math import inf
from typing import NamedTuple

from sensorgen import models
from sensorgen.core import yamlfile
from sensorgen.scene.scene import Scene
from sensorgen.scene.sections import sections

FILE = "expected.yaml"


class MeasuredCost(NamedTuple):
    """A model on one scene.

    ``points`` are the widths of its bounds that it reached [-], each with its time [s]; the time grows with a power of
    the number of ``parts``, of the kind ``counted``. ``loading`` what it needs takes once [s].
    """

    scene: str
    counted: str
    parts: int
    power: float
    points: list[tuple[float, float]]
    loading: float = 0.0


class Size(NamedTuple):
    """Number of parts of the repeating cell of a scene, and whether the sensor's end cuts one."""

    parts: int
    is_cut: bool


def expected(model: str, scene: Scene, width: float) -> tuple[float | None, float | None]:
    """Width and seconds of the fastest measurement that did, or of the one that came nearest, scaled to a scene.

    Parameters
    ----------
    model : str
        Name of a model.
    scene : Scene
        Of any kind; where its parts cannot be counted, time is as measured.
    width : float
        That is wanted [-]; where any will do, nothing is scaled.

    Returns
    -------
    (float, float) or (None, None)
        Nothing where the model was never measured.

    Notes
    -----
    In a cross-section that is cut amid a cell the energy of its own length counts; the relative width is the root of
    the cell's.
    """
    if model not in measured():
        return None, None
    found = points(model, scene if width < inf else None)
    enough = [point for point in found if point[0] <= width]
    return min(enough, key=lambda p: p[1]) if enough else min(found)


def points(model: str, scene: Scene | None) -> list[tuple[float, float]]:
    """All widths that a model reached [-], each with its time [s], scaled to a scene if one is given."""
    found = measured()[model]
    size = _size(scene, found.counted) if scene else None
    root = 0.5 if size and size.is_cut else 1.0
    times = (size.parts / found.parts) ** found.power if size else 1.0
    return [(reached**root, seconds * times) for reached, seconds in found.points]


@cache
def measured() -> dict[str, MeasuredCost]:
    """Each model on its scene."""
    data = yamlfile.parse((resources.files(models) / FILE).read_text("utf-8"), FILE)
    return {
        name: MeasuredCost(**{**entry, "points": [(width, seconds) for width, seconds in entry["points"]]})
        for name, entry in data.items()
    }


@lru_cache(maxsize=8)
def _size(scene: Scene, counted: str) -> Size | None:
    try:
        return COUNTED[counted](scene)
    except ValueError:  # a scene that the model does not apply to either
        return None


def _bands(scene: Scene) -> Size:
    """Pieces of one material in vertical strips without corners."""
    from sensorgen.scene.unit_cell import cell

    found = cell(sections(scene)[0], scene.size_mm[2])
    return Size(sum(len(s.bands) for s in found.slices), len(set(found.shares)) > 1)


def _boxes(scene: Scene) -> Size:
    """Boxes between the electrodes."""
    from sensorgen.solvers.electrostatics.bricks import grid

    return Size(int((grid(scene).fill > 1).sum()), is_cut=False)


COUNTED: dict[str, Callable[[Scene], Size]] = {
    "bands": _bands,
    "pieces": lambda scene: _bands(scene)._replace(is_cut=False),  # of a cell that is pressed by itself
    "boxes": _boxes,
    "cells": lambda _: Size(1, is_cut=False),  # a round one
}
