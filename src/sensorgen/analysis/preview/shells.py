"""Surfaces of scenes as a compressed block of whole numbers.

A JSON header, its length before it, then for every body the differences of vertices [um], of the corners of triangles
and of the ends of edges. Patterns that repeat become repeated bytes, which gzip stores once.
"""

import gzip
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sensorgen.core.arrays import Whole
from sensorgen.scene.geometry.meshes import Mesh, mesh
from sensorgen.scene.scene import Scene

UM_PER_MM = 1000
_FLAT = 0.999  # cosine of the angle up to which two triangles are one face


def packed(header: Mapping[str, Any], scenes: Mapping[str, Scene], names: Sequence[str]) -> bytes:
    """The block, with the number of vertices, triangles and edges of each body of each scene in its header."""
    counts: dict[str, list[list[int]]] = {}
    blocks: list[bytes] = []
    for kind, scene in scenes.items():
        bodies = {body.name: body for body in scene.bodies}
        counts[kind] = []
        for name in names:
            parts = _parts(mesh(bodies[name])) if name in bodies else (np.empty((0, 3), np.int64),) * 3
            counts[kind].append([len(part) for part in parts])
            vertices, triangles, ends = parts
            steps = (np.diff(vertices, axis=0, prepend=0), np.diff(triangles.ravel(), prepend=0),
                     np.diff(ends.ravel(), prepend=0))  # fmt: skip
            blocks += [step.astype("<i4").tobytes() for step in steps]
    head = json.dumps({**header, "counts": counts}, separators=(",", ":"), allow_nan=False).encode()
    head += b" " * (-len(head) % 4)
    return gzip.compress(b"".join([len(head).to_bytes(4, "little"), head, *blocks]), 6, mtime=0)


def _parts(shell: Mesh) -> tuple[Whole, Whole, Whole]:
    """Vertices [um], triangles, and the edges between faces."""
    return np.round(shell.vertices_mm * UM_PER_MM).astype(np.int64), shell.triangles.astype(np.int64), edges(shell)


def edges(shell: Mesh) -> Whole:
    """Pairs of vertices (n, 2) where two faces meet at an angle, sorted."""
    a, b, c = (shell.vertices_mm[shell.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True).clip(1e-300)
    sides = np.sort(shell.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64), axis=1)
    key = sides[:, 0] * len(shell.vertices_mm) + sides[:, 1]
    order = np.argsort(key, kind="stable")
    first, second = order[:-1], order[1:]
    pair = key[first] == key[second]
    first, second = first[pair], second[pair]
    sharp = np.einsum("ij,ij->i", normal[first // 3], normal[second // 3]) < _FLAT
    return sides[first[sharp]]
