"""Netgen's 2D mesher in a process of its own: some outlines end its process, or keep it busy without end.

Run as a program it is the far end of :func:`mesh`, which starts it when needed, and anew after it has ended.
"""

import atexit
import os
import threading
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.core.errors import BadInput, NotInstalled
from sensorgen.core.worker import Worker, WorkerEnded, answer_input

Edge = tuple[tuple[float, float], tuple[float, float]]

_TIMEOUT_S = 120.0  # of one mesh, which takes at most seconds
_WORKER = ("-P", "-m", "sensorgen.solvers.contact.mesher")  # -P: no module of the user's current folder takes part


class Unmeshed(BadInput):
    """No sound mesh of these outlines was found."""


class MesherOutput(NamedTuple):
    """Output of the mesher: places (n, 2), corners (m, 3) and regions (m,) of triangles, sides (k, 2), their edges."""

    points: Real
    corners: Whole
    region: Whole
    sides: Whole
    edge: Whole


def mesh(
    edges: Sequence[tuple[Edge, tuple[int, int]]], size: float, growth: float, sizes: Mapping[int, float], *,
    quick: bool,
) -> MesherOutput:  # fmt: skip
    """Mesh the regions to the left and right of edges; those from 0 down are left open.

    Parameters
    ----------
    edges : sequence of (edge, (int, int))
        Each with the regions to its left and right.
    size, growth : float
        Largest triangle, in the unit of the edges, and by how much triangles grow per distance [-].
    sizes : mapping of int to float
        Largest triangle of a region, where it is another one.
    quick : bool
        Delaunay triangles with one optimisation step in place of an advancing front with three.

    Raises
    ------
    NotInstalled
        Netgen is not installed.
    Unmeshed
        The mesher refuses these outlines, ends its process, or has no answer within two minutes.
    """
    check()
    with _LOCK:
        answer = _exchange((list(edges), size, growth, dict(sizes), quick))
    if isinstance(answer, str):
        raise Unmeshed(f"these outlines cannot be meshed ({answer}): do bodies overlap, or leave slivers?")
    return MesherOutput(*answer)


def check() -> None:
    """Raise NotInstalled without Netgen."""
    if find_spec("netgen") is None:
        raise NotInstalled("meshes need NGSolve: pip install 'sensorgen[fem]'")


_LOCK = threading.Lock()
_running: dict[int, Worker] = {}  # by the process that started it


def _exchange(question: tuple[Any, ...]) -> Any:
    """The mesher's answer; a text where it has none."""
    if not _running:
        atexit.register(_stop)
    worker = _running.get(os.getpid()) or _running.setdefault(os.getpid(), Worker("the mesher", _WORKER, _TIMEOUT_S))
    try:
        return worker.ask(question)
    except WorkerEnded as error:
        _stop()
        return str(error)


def _stop() -> None:
    worker = _running.pop(os.getpid(), None)
    if worker:
        worker.stop()


def _made(
    edges: list[tuple[Edge, tuple[int, int]]], size: float, growth: float, sizes: dict[int, float], quick: bool
) -> tuple[Any, ...] | str:  # fmt: skip
    """Mesh in this process; a text where Netgen refuses."""
    geometry = _geometry(edges)
    for region in {k for _, sides in edges for k in sides if k > 0} if sizes else ():
        geometry.SetDomainMaxH(region, sizes.get(region, size))
    try:
        made = geometry.GenerateMesh(
            maxh=max(size, *sizes.values(), 0.0), grading=growth, optsteps2d=1 if quick else 3, delaunay2d=quick
        )
    except Exception as error:
        return str(error)
    elements, sides = made.Elements2D().NumPy(), made.Elements1D().NumPy()
    return (
        np.array(made.Coordinates(), float)[:, :2].copy(),  # Netgen frees its own with the mesh
        elements["nodes"][:, :3].astype(np.int64) - 1,
        elements["index"].astype(np.int64),
        sides["nodes"][:, :2].astype(np.int64) - 1,
        sides["index"].astype(np.int64),
    )


def _geometry(edges: list[tuple[Edge, tuple[int, int]]]) -> Any:
    from netgen.geom2d import SplineGeometry

    geometry, numbers = SplineGeometry(), dict[tuple[float, float], int]()
    for (a, b), (left, right) in edges:
        for p in (a, b):
            if p not in numbers:
                numbers[p] = geometry.AppendPoint(*p)
        domains = {"leftdomain": max(left, 0), "rightdomain": max(right, 0)}
        geometry.Append(["line", numbers[a], numbers[b]], **domains)
    return geometry


if __name__ == "__main__":
    answer_input(lambda question: _made(*question))
