"""Programs of others on the same scenes and lines, to compare with: scikit-fem, NGSolve, FastCap, scikit-rf, ngspice.

They get a geometry of triangles, boxes or panels that is made here without any of the models' meshes.
"""

import shutil
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from importlib.util import find_spec

from sensorgen.core.bounds import Interval
from sensorgen.scene.scene import Scene

Levels = list[tuple[str, Callable[[], float | Interval]]]  # words, and work that gives a capacitance or bounds [F]

FIELD = {"scikit-fem": "skfem", "NGSolve": "ngsolve", "FastCap": "fastcap2"}
ALL = (*FIELD, "scikit-rf", "ngspice")
_FILES = {"scikit-fem": "scikit_fem", "NGSolve": "ngsolve_fem", "FastCap": "fastcap"}
# Layers towards corners or edges; and order, where it can be chosen
_TRIANGLES: dict[str, tuple[tuple[int, ...], ...]] = {
    "scikit-fem": ((2,), (5,), (10,), (20,)), "NGSolve": ((2, 3), (4, 5), (6, 8), (10, 10), (14, 14)),
}  # fmt: skip
_BRICKS: dict[str, tuple[tuple[int, ...], ...]] = {
    "scikit-fem": ((0,), (1,), (2,)), "NGSolve": ((0, 2), (0, 4), (1, 3), (1, 5), (2, 6)),
}  # fmt: skip
SLOW_TO_CONVERGE = ("FastCap",)  # off by more than its last step: no reference
_PANELS = (2, 3, 4, 7)  # along the height of the cell


def missing(peer: str) -> str:
    """Why a peer cannot run here, or ""."""
    if peer == "ngspice":
        return "" if shutil.which("ngspice") else "ngspice is not installed (Debian: apt install ngspice)"
    name = {**FIELD, "scikit-rf": "skrf"}[peer]
    packages = {"skfem": "scikit-fem", "skrf": "scikit-rf"}
    return "" if find_spec(name) else f"not installed: pip install {packages.get(name, name)}"


def applicable(peer: str, scene: Scene, permittivity: Mapping[str, float]) -> tuple[Levels, str]:
    """Levels of a peer on a scene, as :func:`levels`; none, and why, where it is not installed or cannot take it."""
    if why := missing(peer):
        return [], why
    try:
        return levels(peer, scene, permittivity), ""
    except ValueError as error:
        return [], str(error)


def levels(peer: str, scene: Scene, permittivity: Mapping[str, float]) -> Levels:
    """A peer's capacitances of a scene, from coarse to fine.

    Parameters
    ----------
    peer : str
        Of ``FIELD``.
    scene : Scene
        As models see it.
    permittivity : mapping of str to float
        Of its dielectrics and of "air" [-].

    Raises
    ------
    ValueError
        The scene is neither a constant cross-section nor made of boxes, or has no mirrors or a cell that its end cuts.
    """
    from sensorgen.verification.peers import cells

    geometry = cells.geometry(scene)
    cells.share(geometry)  # refuses a cell that is cut: its weighted energies are those of another field
    words: list[tuple[str, tuple[int, ...]]]
    module = import_module(f"sensorgen.verification.peers.{_FILES[peer]}")
    if peer == "FastCap":
        work, words = module.capacitance, [(f"{n} panels along the height, ", (n,)) for n in _PANELS]
    else:
        flat = isinstance(geometry, cells.PlaneSection)
        of_order = (
            (how, "".join(f" of order {p}" for p in how[1:])) for how in (_TRIANGLES if flat else _BRICKS)[peer]
        )
        work, words = module.plane if flat else module.boxes, [(f"{how[0]} layers{o}, ", how) for how, o in of_order]
    return [(level, partial(work, geometry, permittivity, *how)) for level, how in words]
