"""Rise of the capacitance of drawn cells of tri, whose flanks roll onto each other, by NGSolve up to 1.1 MPa.

A second program beside press2d, which shares no line with it: neo-Hookean plane strain with displacements of order 3
and pressures of order 2, contact of the flanks by a penalty at integration points (``ContactBoundary``), and a
potential of order 5 on a mesh of the deformed outlines. Writes tests/reference/tri_contact.json; two minutes of
processor time.
"""

import json
from dataclasses import dataclass
from itertools import pairwise
from math import hypot
from pathlib import Path

import ngsolve as ng
import numpy as np
import shapely
from netgen.geom2d import SplineGeometry

FILE = Path(__file__).parents[1] / "tests" / "reference" / "tri_contact.json"
MODULUS_MPA, NU = {"top": 22.0, "bottom": 22.0, "x60": 6.0}, 0.4999
EPS, EPS0_F_PER_M = {"x60": 4.68, "air": 1.00059}, 8.8541878128e-12
PENALTY_MPA, SLOPE = 360.0, 0.1  # of a contact over half of the size of its elements, which grow from the apex
REACH_MM, PER_EDGE = 0.03, 6  # how far a partner is looked for; parts of an element's edge when deformed
CLOSED_MM = 2e-5  # half of the gap that counts as closed
CORNER_MM, FIELD_MM = 2e-3, 0.05  # elements of the field at corners, and elsewhere
SMALL = ((0.004, 0.02, 0.1, 3), (0.002, 0.02, 0.1, 3)), (10.0, 30.0, 60.0, 100.0), 40.0
LARGE = ((0.08, 0.08, 0.15, 3), (0.05, 0.05, 0.1, 3)), (345.0, 600.0, 1103.0), 60.0
_THIN = {"period_mm": 5.0, "hang_height_mm": 0.42, "lower_height_mm": 0.12, "dielectric_mm": 0.12, "electrode_mm": 0.12}
_SMALL = {"period_mm": 1.2, "hang_height_mm": 0.4, "lower_height_mm": 0.2, "dielectric_mm": 0.05}
CELLS = (  # parameters, with meshes (size at apexes, corners and elsewhere [mm], order), loads, longest step [kPa]
    ({"dielectric_mm": 0.2}, *LARGE), ({"dielectric_mm": 0.1}, *LARGE), ({"dielectric_mm": 0.2}, *SMALL),
    ({"dielectric_mm": 0.1}, *SMALL), (_SMALL, *SMALL), (_THIN, *SMALL),
)  # fmt: skip
USUAL = {"period_mm": 2.0, "hang_height_mm": 0.5, "lower_height_mm": 0.24, "electrode_mm": 0.3}


@dataclass
class Cell:
    """Half a period: nodes [mm], and edges from node to node with the regions to their left and right, and a name."""

    half_mm: float
    nodes: dict
    edges: tuple
    regions: tuple = ("bottom", "x60", "top", "x60")


def cell_of(parameters, apex_mm, corner_mm, largest_mm):
    """From the apex of the conductor's teeth to that of the dielectric's, with the size of elements at each node."""
    size = USUAL | parameters
    half, film, electrode = size["period_mm"] / 2, size["dielectric_mm"], size["electrode_mm"]
    foot, middle = electrode + film, half / 2
    crest, roof = foot + size["hang_height_mm"], foot + size["hang_height_mm"] + electrode
    nodes = {
        "b0": (0, 0, largest_mm), "b1": (half, 0, largest_mm), "e0": (0, electrode, largest_mm),
        "e1": (half, electrode, largest_mm), "a0": (0, foot, apex_mm), "a1": (half, foot, apex_mm),
        "r": (middle, foot + size["lower_height_mm"], corner_mm), "v": (middle, crest, corner_mm),
        "u1": (half, crest, corner_mm), "t0": (0, roof, largest_mm), "t1": (half, roof, largest_mm),
    }  # fmt: skip
    edges = (
        ("b0", "b1", 1, 0, "base"), ("b1", "e1", 1, 0, "side"), ("e1", "e0", 1, 2, "in"), ("e0", "b0", 1, 0, "side"),
        ("e1", "a1", 2, 0, "side"), ("a1", "r", 2, 0, "lower"), ("r", "a0", 2, 0, "lower"), ("a0", "e0", 2, 0, "side"),
        ("a0", "v", 3, 0, "upper"), ("v", "u1", 3, 4, "in"), ("u1", "t1", 3, 0, "side"), ("t1", "t0", 3, 0, "roof"),
        ("t0", "a0", 3, 0, "side"), ("v", "a1", 4, 0, "upper"), ("a1", "u1", 4, 0, "side"),
    )  # fmt: skip
    return Cell(half, nodes, edges)


class Pressed:
    """A cell under an even pressure, in steps."""

    def __init__(self, cell, apex_mm, corner_mm, largest_mm, order):
        self.cell, geometry = cell, SplineGeometry()
        number = {name: geometry.AppendPoint(x, z, maxh=size) for name, (x, z, size) in cell.nodes.items()}
        for k, (a, b, left, right, name) in enumerate(cell.edges):
            geometry.Append(["line", number[a], number[b]], leftdomain=left, rightdomain=right, bc=f"{name}_{k}")
        for k, name in enumerate(cell.regions, 1):
            geometry.SetMaterial(k, name)
        self.mesh = mesh = ng.Mesh(geometry.GenerateMesh(maxh=largest_mm, grading=0.4))
        moved = ng.VectorH1(mesh, order=order, dirichlet="base.*", dirichletx="side.*")
        self.space = moved * ng.L2(mesh, order=order - 1)
        (u, p), self.load = self.space.TrialFunction(), ng.Parameter(0)
        modulus = mesh.MaterialCF(MODULUS_MPA)
        mu, bulk = modulus / (2 * (1 + NU)), modulus * NU / ((1 + NU) * (1 - 2 * NU))
        f = ng.Id(2) + ng.Grad(u)
        j = ng.Det(f)
        energy = mu / 2 * (ng.InnerProduct(f, f) - 2) - mu * ng.log(j) + p * (j - 1) - p**2 / (2 * bulk)
        self.form = ng.BilinearForm(self.space, symmetric=True)
        self.form += ng.Variation(energy.Compile() * ng.dx)
        self.form += ng.Variation(self.load * u[1] * ng.ds("roof.*"))
        self.contact = ng.ContactBoundary(mesh.Boundaries("upper.*"), mesh.Boundaries("lower.*"))
        at = ng.CF((ng.x, ng.y))
        depth = (at + u - at.Other() - u.Other()) * self.contact.normal
        from_apex = ng.IfPos(ng.x - cell.half_mm / 2, cell.half_mm - ng.x, ng.x)
        size = apex_mm / 2 + SLOPE * (from_apex if apex_mm < corner_mm else 4 * corner_mm)
        stiffness = PENALTY_MPA / size
        self.contact.AddEnergy(ng.IfPos(depth, stiffness / 2 * depth * depth, 0))
        self.state, self.reached = ng.GridFunction(self.space), 0.0

    def converges(self, pressure_mpa):
        """Newton's iteration, partners sought anew in each turn; False, and the state before, where it does not end."""
        self.load.Set(pressure_mpa)
        state = self.state.vec
        before, residual, change = (state.CreateVector() for _ in range(3))
        before.data = state
        for _ in range(25):
            self.contact.Update(self.state.components[0], self.form, intorder=10, maxdist=REACH_MM)
            self.form.Apply(state, residual)
            self.form.AssembleLinearization(state)
            change.data = self.form.mat.Inverse(self.space.FreeDofs(), inverse="sparsecholesky") * residual
            off = abs(ng.InnerProduct(change, residual)) ** 0.5
            if not off < 1e3:
                break
            state.data -= change
            if off < 1e-6:
                return True
        state.data = before
        return False

    def to(self, pressure_mpa, longest_mpa):
        """Load up to a pressure; RuntimeError where no step is short enough."""
        step = longest_mpa
        while self.reached < pressure_mpa - 1e-12:
            target = min(pressure_mpa, self.reached + step)
            if self.converges(target):
                self.reached, step = target, min(1.5 * step, longest_mpa)
            elif step < longest_mpa / 32:
                raise RuntimeError(f"no equilibrium beyond {1e3 * self.reached:.4g} kPa")
            else:
                step /= 2

    def displacement_um(self):
        """Mean of the top's, downwards."""
        roof = self.mesh.Boundaries("roof.*")
        return -1e3 * ng.Integrate(self.state.components[0][1], self.mesh, ng.BND, definedon=roof) / self.cell.half_mm

    def outlines(self):
        """Name and deformed polygon of each region [mm]."""
        rule = ng.IntegrationRule([(k / PER_EDGE,) for k in range(PER_EDGE + 1)], [0.0] * (PER_EDGE + 1))
        at = ng.CF((ng.x, ng.y)) + self.state.components[0]
        places = at(self.mesh.MapToAllElements(rule, ng.BND)).reshape(-1, PER_EDGE + 1, 2)
        lines = {k: [] for k in range(1, len(self.cell.regions) + 1)}
        for element, line in zip(self.mesh.Elements(ng.BND), places, strict=True):
            for k in self.cell.edges[int(element.mat.rsplit("_", 1)[1])][2:4]:
                if k:
                    lines[k].append(shapely.LineString(np.round(line, 9)))
        whole = {k: shapely.polygonize([shapely.union_all(parts)]).geoms for k, parts in lines.items()}
        return [(self.cell.regions[k - 1], max(parts, key=lambda p: p.area)) for k, parts in whole.items()]


def capacitance(outlines, half_mm):
    """Per area [F/m2], by the energy of the best potential: never too small. A mesh that fails is tried less finely."""
    for k in range(6):
        try:
            return field(outlines, half_mm, CLOSED_MM * 1.5**k, (1 + k) * CLOSED_MM / 8)
        except Exception as error:  # the mesher's own
            print("again:", error)
    raise RuntimeError("the deformed outlines cannot be meshed")


def field(outlines, half_mm, closed_mm, grid_mm):
    """As :func:`capacitance`, with gaps of twice ``closed_mm`` closed, on a grid of coordinates."""
    high = max(part.bounds[3] for _, part in outlines)
    top, bottom, x60 = (shapely.union_all([p for n, p in outlines if n == name]) for name in ("top", "bottom", "x60"))
    mitre = {"join_style": "mitre", "mitre_limit": 2.0}
    whole, tidy = shapely.box(0, 0, half_mm, high), {"grid_size": grid_mm}
    solid = shapely.union_all([top, bottom, x60], **tidy).simplify(2 * grid_mm)
    closed = solid.buffer(closed_mm, **mitre).buffer(-closed_mm, **mitre)
    conductor = shapely.union_all([top, bottom], **tidy).simplify(2 * grid_mm)
    air = shapely.difference(shapely.difference(whole, closed, **tidy).simplify(2 * grid_mm), conductor, **tidy)
    inside = shapely.box(0, 0, half_mm, high - 1e-3)
    air = shapely.union_all([p for p in _polygons(air) if p.buffer(-closed_mm).area and p.within(inside)])
    x60 = shapely.difference(whole, shapely.union_all([conductor, air], **tidy), **tidy)
    parts = [(name, p) for name, region in (("x60", x60), ("air", air)) for p in _polygons(region)]
    parts = [(name, p) for name, p in parts if p.buffer(-closed_mm).area and p.within(inside)]
    lines = shapely.union_all([p.boundary for _, p in parts], **tidy)
    geometry, sides, region = SplineGeometry(), {}, 0
    for face in shapely.polygonize([lines]).geoms:
        name = next((n for n, p in parts if p.contains(face.representative_point())), None)
        if name:
            region += 1
            geometry.SetMaterial(region, name)
            ring = [tuple(np.round(q, 8).tolist()) for q in shapely.orient_polygons(face).exterior.coords]
            for a, b in pairwise(ring):
                if (b, a) in sides:
                    sides[b, a] = (sides[b, a][0], region)
                else:
                    sides[a, b] = (region, 0)
    ways, number = {}, {}
    for (xa, za), (xb, zb) in sides:
        way = np.array([xb - xa, zb - za]) / hypot(xb - xa, zb - za)
        ways.setdefault((xa, za), []).append(way)
        ways.setdefault((xb, zb), []).append(-way)
    for (a, b), (left, right) in sides.items():
        for q in (a, b):
            straight = len(ways[q]) == 2 and ways[q][0] @ ways[q][1] < -0.98
            number[q] = number.get(q) or geometry.AppendPoint(*q, maxh=1e9 if straight else CORNER_MM)
        middle = shapely.Point((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
        wall = a[0] == b[0] and min(abs(a[0]), abs(a[0] - half_mm)) < 2 * grid_mm
        plate = "top" if top.distance(middle) < bottom.distance(middle) else "bottom"
        name = "in" if right else "side" if wall else plate
        geometry.Append(["line", number[a], number[b]], leftdomain=left, rightdomain=right, bc=name)
    mesh = ng.Mesh(geometry.GenerateMesh(maxh=FIELD_MM, grading=0.4))
    space = ng.H1(mesh, order=5, dirichlet="top|bottom")
    u, v = space.TnT()
    energy = ng.BilinearForm(space, symmetric=True)
    energy += mesh.MaterialCF(EPS) * ng.grad(u) * ng.grad(v) * ng.dx
    energy.Assemble()
    phi = ng.GridFunction(space)
    phi.Set(mesh.BoundaryCF({"top": 1.0}, default=0), ng.BND)
    phi.vec.data -= energy.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky") * (energy.mat * phi.vec)
    return EPS0_F_PER_M * ng.InnerProduct(energy.mat * phi.vec, phi.vec) / (half_mm * 1e-3)


def _polygons(region):
    return [p for p in getattr(region, "geoms", [region]) if p.geom_type == "Polygon" and p.area]


def solved(parameters, mesh, loads_kpa, longest_kpa):
    """Displacement [um] and rise at each load on one mesh."""
    apex_mm, corner_mm, largest_mm, order = mesh
    cell = cell_of(parameters, apex_mm, corner_mm, largest_mm)
    pressed, loads = Pressed(cell, apex_mm, corner_mm, largest_mm, order), []
    at_rest = capacitance(pressed.outlines(), cell.half_mm)
    for kpa in loads_kpa:
        try:
            pressed.to(kpa / 1e3, longest_kpa / 1e3)
        except RuntimeError as error:
            print(error)
            break
        rise = capacitance(pressed.outlines(), cell.half_mm) / at_rest - 1
        loads.append({"pressure_kpa": kpa, "displacement_um": pressed.displacement_um(), "rise": rise})
    return {"mesh": mesh, "capacitance_nf_per_m2": 1e9 * at_rest, "loads": loads}


def main():
    cells = []
    for parameters, meshes, loads_kpa, longest_kpa in CELLS:
        solutions = [solved(parameters, mesh, loads_kpa, longest_kpa) for mesh in meshes]
        cells.append({"parameters": parameters, "meshes": solutions})
        print(cells[-1], flush=True)
        about = {"origin": __doc__.partition("\n")[0], "youngs_modulus_mpa": MODULUS_MPA, "poisson_ratio": NU}
        FILE.write_text(json.dumps(about | {"cells": cells}, indent=1) + "\n")


if __name__ == "__main__":
    main()
