"""The rect cell pressed in three dimensions, small strains: mixed finite elements in NGSolve, capacitance by mapping.

A second program beside press3d. Solid parts are nearly incompressible: displacement of order 3, pressure of order 1 in
each tetrahedron, which has to jump where materials meet, or the free cell rises by 20 % too much. Air gives way without
stress, so that the displacement goes on through it smoothly. The deformed capacitance is that of the undeformed mesh
with the permittivity J F^-1 F^-T, which is exact for the displacement that was found. No contact, no large strain: the
gaps of this cell stay open far beyond the stresses that a finger makes.
"""

from typing import Any

from sensorgen.design.design import Design

AIR_PA = 1.0  # of the stand-in for air, some 1e-7 of the film's
_CONDUCTOR = 1e6  # relative permittivity that stands for one


def rises(
    design: Design,
    solids: dict[str, tuple[float, float]],
    permittivity: dict[str, float],
    stress_pa: list[float],
    *,
    free: bool = False,
    mesh_mm: float = 0.2,
) -> tuple[list[float], list[float]]:
    """Displacement of the top [m] and capacitance per area over the unloaded one [-] at each stress.

    Parameters
    ----------
    design : Design
        Of shape rect.
    solids : dict
        Young's modulus [Pa] and Poisson's ratio of each material.
    permittivity : dict
        Relative permittivity of each dielectric and of "air" [-].
    stress_pa : list of float
        Even pressure on the top [Pa].
    free : bool
        Base sliding and sides free to move straight outwards; else base bonded and sides fixed.
    mesh_mm : float
        Longest edge [mm].
    """
    import ngsolve as ng

    mesh, materials, size = _mesh(design, mesh_mm)
    with ng.TaskManager():
        u, (wide, deep) = _displaced(mesh, materials, solids, free=free)
        down = -ng.Integrate(u[2], mesh, ng.BND, definedon=mesh.Boundaries("top")) / (size[0] * size[1])
        shares = [p * 1e-6 for p in stress_pa]  # of 1 MPa, for which it was solved; lengths in mm
        unloaded = _capacitance(mesh, materials, permittivity, u, 0.0)
        cells = [_capacitance(mesh, materials, permittivity, u, share) / unloaded for share in shares]
        found = [c / ((1 + wide * share) * (1 + deep * share)) for c, share in zip(cells, shares, strict=True)]
    return [float(down) * share * 1e-3 for share in shares], found


def _mesh(design: Design, mesh_mm: float) -> tuple[Any, list[str], tuple[float, float, float]]:
    """A quarter of one cell between the mirrors in the middle of a conductor strip and of a dielectric one."""
    import ngsolve as ng
    from netgen.occ import Box, Glue, OCCGeometry, Pnt

    scene, half, start = design.in_use, design.params.period_mm / 2, design.params.etpu_width_mm / 2
    cell = (start, start, 0.0), (start + half, start + half, scene.size_mm[2])
    parts, air = [], Box(Pnt(*cell[0]), Pnt(*cell[1]))
    for body in scene.bodies:
        for prism in body.pieces:
            spans = [prism.span(axis) for axis in "xyz"]
            low = [max(span[0], edge) for span, edge in zip(spans, cell[0], strict=True)]
            high = [min(span[1], edge) for span, edge in zip(spans, cell[1], strict=True)]
            if all(b - a > 1e-9 for a, b in zip(low, high, strict=True)):
                solid = Box(Pnt(*low), Pnt(*high))
                air = air - solid
                solid.mat(f"{body.material}/{body.terminal}")
                parts.append(solid)
    air.mat("air/")
    glued = Glue([*parts, air])
    for face in glued.faces:
        c = face.center
        off = {"left": c.x - start, "right": c.x - start - half, "front": c.y - start, "back": c.y - start - half,
               "base": c.z, "top": c.z - scene.size_mm[2]}  # fmt: skip
        face.name = next((name for name, distance in off.items() if abs(distance) < 1e-7), "inner")
    mesh = ng.Mesh(OCCGeometry(glued).GenerateMesh(maxh=mesh_mm))
    return mesh, list(mesh.GetMaterials()), (half, half, scene.size_mm[2])


def _displaced(mesh: Any, materials: list[str], solids: dict[str, tuple[float, float]], *, free: bool) -> Any:
    """Displacement [mm] under 1 MPa, and how free sides widen, as planes, by one number for each direction."""
    import ngsolve as ng

    bonded = "" if free else "|base"
    space = ng.VectorH1(
        mesh, order=3, dirichletx=f"left|right{bonded}", dirichlety=f"front|back{bonded}", dirichletz="base"
    )
    hard = "|".join(sorted({m for m in materials if not m.startswith("air")}))
    spaces = space * ng.L2(mesh, order=1, definedon=hard) * ng.NumberSpace(mesh) * ng.NumberSpace(mesh)
    (u, p, a, b), (v, q, c, d) = spaces.TnT()
    e = {m: AIR_PA if m.startswith("air") else solids[m.partition("/")[0]][0] for m in materials}
    nu = {m: 0.0 if m.startswith("air") else solids[m.partition("/")[0]][1] for m in materials}
    mu = ng.CoefficientFunction([e[m] * 1e-6 / (2 * (1 + nu[m])) for m in materials])  # MPa
    weak = ng.CoefficientFunction(
        [(1 - 2 * nu[m]) * (1 + nu[m]) / (e[m] * 1e-6 * nu[m]) if nu[m] else 1.0 for m in materials]
    )

    def strain(w: Any, wide: Any, deep: Any) -> Any:
        sides = ng.CoefficientFunction((wide, 0, 0, 0, deep, 0, 0, 0, 0), dims=(3, 3))
        return 0.5 * (ng.Grad(w) + ng.Grad(w).trans) + (sides if free else 0 * sides)

    one, other = strain(u, a, b), strain(v, c, d)
    form = ng.BilinearForm(spaces, symmetric=True)
    form += 2 * mu * ng.InnerProduct(one, other) * ng.dx
    form += (p * ng.Trace(other) + q * ng.Trace(one) - weak * p * q) * ng.dx(definedon=hard)
    if not free:
        form += (a * c + b * d) * ng.dx
    load = ng.LinearForm(spaces)
    load += -1.0 * v[2] * ng.ds("top")
    found = ng.GridFunction(spaces)
    form.Assemble()
    load.Assemble()
    found.vec.data = form.mat.Inverse(spaces.FreeDofs(), inverse="umfpack") * load.vec
    wide, deep = (float(found.components[k].vec[0]) if free else 0.0 for k in (2, 3))
    sides = ng.CoefficientFunction((wide * (ng.x - _least(mesh, 0)), deep * (ng.y - _least(mesh, 1)), 0))
    whole = ng.GridFunction(ng.VectorH1(mesh, order=3))
    whole.Set(found.components[0] + sides)
    return whole, (wide, deep)


def _least(mesh: Any, axis: int) -> float:
    return min(float(v.point[axis]) for v in mesh.vertices)


def _capacitance(mesh: Any, materials: list[str], permittivity: dict[str, float], u: Any, share: float) -> float:
    """Of the mapped cell, conductors as a million times the permittivity; in units of its own."""
    import ngsolve as ng

    eps = ng.CoefficientFunction(
        [_CONDUCTOR if m.rpartition("/")[2] else permittivity[m.partition("/")[0]] for m in materials]
    )
    stretch = ng.Id(3) + share * ng.Grad(u)
    inverse = ng.Inv(stretch)
    mapped = eps * ng.Det(stretch) * inverse * inverse.trans
    space = ng.H1(mesh, order=3, dirichlet="top|base")
    v, w = space.TnT()
    form = ng.BilinearForm(space, symmetric=True)
    form += (mapped * ng.grad(v)) * ng.grad(w) * ng.dx
    potential = ng.GridFunction(space)
    potential.Set(1.0, definedon=mesh.Boundaries("top"))
    form.Assemble()
    potential.vec.data -= form.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky") * (form.mat * potential.vec)
    return float(ng.Integrate((mapped * ng.grad(potential)) * ng.grad(potential), mesh))
