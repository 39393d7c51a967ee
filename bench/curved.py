"""Width of the bounds over time for curved and slanted bodies, beside plain NGSolve of 40 lines in the same run.

Writes ``results/curved.md``. Seconds are of the processor, imports left out, on one core of a small server.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import time
from collections.abc import Iterator
from math import pi, tan
from pathlib import Path

import netgen.occ as occ
import ngsolve as ng

from sensorgen.scene.polyhedra import Loft
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Piece, Prism, box
from sensorgen.solvers.electrostatics.round_bodies import LEVELS, RoundCell, mesh_of, solid, solved

FILM, HIGH, HALF = 0.1, 0.5, 0.5
EPS = (3.0, 2.5, 1.0)
BUDGET_S = 20.0  # a finer level takes four times as long
HEAD = """# Curved and slanted bodies: width over time

Made by `bench/curved.py`: a quarter of a cell of 2 mm by 2 mm, film of 0.1 mm (permittivity 3), body 0.5 mm high
(metal, or permittivity 2.5) and air. Half-width of the bounds over the capacitance, geometric error included, and
processor time [s]. Plain: NGSolve alone, order 3 on ungraded elements of 0.2 and 0.1 mm, over the middle of the bounds;
it states no error, and was not tried where bodies touch.

"""


def pattern(name: str, low: float) -> Piece:
    """A body of 0.5 mm that hangs from the top electrode down to a height."""
    roof = low + HIGH
    square = ((-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF))
    bodies = {
        "bump": lambda: Revolved(0, 0, ((0, low), (HALF, roof), (0, roof)), (tan(pi / 8), 0, 0)),
        "cone": lambda: Revolved(0, 0, ((0, low), (HALF, roof), (0, roof))),
        "blunt cone": lambda: Revolved(0, 0, ((0, low), (0.15, low), (HALF, roof), (0, roof))),
        "pyramid": lambda: Loft(((0, 0),) * 4, square, low, roof),
        "slanted strip": lambda: Prism("x", ((-0.1, low), (0.1, low), (HALF, roof), (-HALF, roof)), -1, 2),
        "box": lambda: box(-HALF, HALF, -HALF, HALF, low, roof),
    }
    return bodies[name]()


def cell(name: str, gap: float, *, metal: bool) -> RoundCell:
    """A quarter of a cell of 2 mm by 2 mm."""
    roof = FILM + gap + HIGH
    plates = (
        (box(-2, 2, -2, 2, -0.1, 0), 0),
        (box(-2, 2, -2, 2, roof, roof + 0.1), 1),
        (box(-2, 2, -2, 2, 0, FILM), 2),
    )
    body = (pattern(name, FILM + gap), 1 if metal else 3)
    return RoundCell((0, 0, -0.1), (1, 1, roof + 0.1), (*plates, body), 2, EPS)


def plain(one: RoundCell, order: int, longest: float) -> float:
    """From above: a potential on curved tetrahedra of one size, as NGSolve's tutorials have it."""
    (x0, y0, _), (x1, y1, _), roof = one.low_mm, one.high_mm, one.high_mm[2] - 0.1
    whole = occ.Box((x0, y0, 0), (x1, y1, roof))
    film = occ.Box((x0, y0, 0), (x1, y1, FILM))
    body, kind = one.pieces[-1]
    shape = solid(body) * whole
    air = whole - film - shape
    air.mat("air")
    film.mat("film")
    shape.mat("body")
    held = shape if kind == 1 else None
    for face in shape.faces:
        face.name = "top" if held else "between"
    glued = occ.Glue([air, film] if held else [air, film, shape])
    for face in glued.faces:
        low, high = face.bounding_box
        for name, at in (("bottom", 0.0), ("top", roof)):
            if max(abs(low.z - at), abs(high.z - at)) < 1e-6:
                face.name = name
        for axis in (0, 1):
            for at in (one.low_mm[axis], one.high_mm[axis]):
                if max(abs(tuple(low)[axis] - at), abs(tuple(high)[axis] - at)) < 1e-6:
                    face.name = "side"
    mesh = ng.Mesh(occ.OCCGeometry(glued).GenerateMesh(maxh=longest))
    mesh.Curve(order)
    eps = mesh.MaterialCF({"film": EPS[0], "body": EPS[1], "air": EPS[2]})
    space = ng.H1(mesh, order=order, dirichlet="bottom|top")
    u, v = space.TnT()
    field = ng.GridFunction(space)
    field.Set(1, definedon=mesh.Boundaries("top"))
    form = ng.BilinearForm(eps * ng.grad(u) * ng.grad(v) * ng.dx, symmetric=True).Assemble()
    residual = (form.mat * field.vec).Evaluate()
    field.vec.data -= form.mat.Inverse(space.FreeDofs(), "sparsecholesky") * residual
    return float(ng.Integrate(eps * ng.grad(field) * ng.grad(field), mesh, order=2 * order + 2))


def rows() -> Iterator[str]:
    yield "| scene | half-width, order 3 | s | order 4 | s | order 5 | s | plain | s | plain, finer | s |"
    yield "|---|---|---|---|---|---|---|---|---|---|---|"
    for name in ("bump", "cone", "blunt cone", "pyramid", "slanted strip", "box"):
        yield row(name, 0.05, metal=True)
    yield row("bump", 0.05, metal=False)
    yield row("bump", 0.0, metal=True)
    yield row("cone", 0.0, metal=True)


def row(name: str, gap: float, *, metal: bool) -> str:
    """Widths and times of three levels, and how far plain NGSolve is above the middle of the last."""
    one, found, middle = cell(name, gap, metal=metal), [], 0.0
    for level in LEVELS[1:4]:
        start = time.process_time()
        bounds = solved(mesh_of(one, level.order, level.layers, level.closed), level.order)
        seconds, middle = time.process_time() - start, (bounds.upper + bounds.lower) / 2
        found += [f"{(bounds.upper - bounds.lower) / 2 / middle + bounds.rounding:.1e}", f"{seconds:.2g}"]
        if seconds * 4 > BUDGET_S:
            break
    found += ["", ""] * (3 - len(found) // 2)
    for longest in (0.2, 0.1) if gap else ():
        start = time.process_time()
        try:
            value = plain(one, 3, longest)
        except Exception as error:  # Netgen's are of no one kind
            found += [type(error).__name__, ""]
            continue
        found += [f"{value / middle - 1:+.1e}", f"{time.process_time() - start:.2g}"]
    found += [""] * (10 - len(found))
    told = f"{name}, {'metal' if metal else 'dielectric'}, {'gap 0.05 mm' if gap else 'touching'}"
    print(told, found, flush=True)
    return f"| {told} | {' | '.join(found)} |"


if __name__ == "__main__":
    text = "\n".join(rows())
    (Path(__file__).parent / "results" / "curved.md").write_text(HEAD + text + "\n", "utf-8")
