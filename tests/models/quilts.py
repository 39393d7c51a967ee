"""Random scenes of slanted patches, and their capacitance by adaptive elements of scikit-fem on a mesh of their own."""

from dataclasses import dataclass, replace

import numpy as np

from sensorgen.scene.scene import Body, Prism, Scene

ENDS = ("bottom", "top")


@dataclass(frozen=True)
class Quilt:
    """Patches between upright lines and lines that run from left to right.

    Attributes
    ----------
    x_mm : (n + 1,) array
        Upright lines.
    z_mm : (n + 1, m + 1) array
        Heights of the other lines on each.
    fill : (n, m) array of str
        Material of each patch, or the electrode, "bottom" or "top".
    """

    x_mm: np.ndarray
    z_mm: np.ndarray
    fill: np.ndarray

    @classmethod
    def random(cls, seed: int) -> "Quilt":
        """Up to six columns of up to five layers, a film of 1e-3 to 0.5 mm; islands of electrode in every other."""
        random = np.random.default_rng(seed)
        columns, layers = random.integers(1, 7), random.integers(1, 6)
        x = np.concatenate([[0.0], np.cumsum(random.uniform(0.1, 0.8, columns))])
        gaps = random.uniform(0.05, 0.5, (columns + 1, layers))
        gaps[:, 0] = 10 ** random.uniform(-3, -0.3)
        steps = np.column_stack([random.uniform(0.1, 0.3, columns + 1), gaps, np.full(columns + 1, 0.0)])
        z = np.column_stack([np.zeros(columns + 1), np.cumsum(steps, axis=1)])
        z[:, -1] = z.max() + 0.2
        middle = random.choice(["air", "x60", "pva"], (columns, layers), p=[0.4, 0.4, 0.2])
        if seed % 2:
            island = random.random((columns, layers)) < 0.15
            island[:, 0] = False
            middle = np.where(island, random.choice(ENDS, (columns, layers)), middle)
        low, high = (np.full((columns, 1), end) for end in ENDS)
        return cls(x.round(6), z.round(6), np.concatenate([low, middle, high], axis=1))

    def scene(self) -> Scene:
        """One prism for each patch."""
        bodies = []
        for what in sorted(set(self.fill.ravel()) - {"air"}):
            end = what if what in ENDS else ""
            prisms = tuple(Prism("y", self.outline(i, k), 0.0, 1.0) for i, k in np.argwhere(self.fill == what))
            bodies.append(Body(what, "etpu" if end else what, prisms, end))
        return Scene(tuple(bodies), (float(self.x_mm[-1]), 1.0, float(self.z_mm[0, -1])))

    def outline(self, i: int, k: int) -> tuple[tuple[float, float], ...]:
        """Of a patch; one whose lines meet is a triangle."""
        x, z = self.x_mm, self.z_mm
        found = (x[i], z[i, k]), (x[i + 1], z[i + 1, k]), (x[i + 1], z[i + 1, k + 1]), (x[i], z[i, k + 1])
        return tuple((float(u), float(v)) for n, (u, v) in enumerate(found) if (u, v) != found[n - 1])

    def mirrored(self) -> "Quilt":
        """Left for right."""
        return replace(
            self, x_mm=(self.x_mm[-1] - self.x_mm[::-1]).round(6), z_mm=self.z_mm[::-1], fill=self.fill[::-1]
        )

    def swapped(self) -> "Quilt":
        """Upside down, with its ends named anew."""
        ends = {"bottom": "top", "top": "bottom"}
        fill = np.vectorize(lambda what: ends.get(what, what))(self.fill[:, ::-1])
        return replace(self, z_mm=(self.z_mm[0, -1] - self.z_mm[:, ::-1]).round(9), fill=fill)

    def at(self, places: np.ndarray) -> np.ndarray:
        """What is at places (2, n)."""
        i = np.clip(np.searchsorted(self.x_mm, places[0]) - 1, 0, len(self.x_mm) - 2)
        share = (places[0] - self.x_mm[i]) / (self.x_mm[i + 1] - self.x_mm[i])
        z = self.z_mm[i] * (1 - share)[:, None] + self.z_mm[i + 1] * share[:, None]
        return self.fill[i, np.clip((z < places[1][:, None]).sum(axis=1) - 1, 0, self.fill.shape[1] - 1)]


def by_adaptive_elements(quilt: Quilt, weight: dict[str, complex], unknowns: int, ends=ENDS) -> list[complex]:
    """Energies of quadratic functions, 0 and 1 at both ends, on meshes that shrink where their flux jumps; finest last.

    Between the electrodes with permittivities for weights an upper bound of C / eps0; without islands, between both
    mirrors ("left", "right") with their inverses, one of eps0 / C.
    """
    import skfem
    from skfem.helpers import dot, grad

    @skfem.BilinearForm(dtype=complex)
    def energy(u, v, w):
        return w.eps * dot(grad(u), grad(v))

    @skfem.Functional
    def jump(w):
        flux = [e * dot(grad(u), w.n) for e, u in ((w.e1, w.u1), (w.e2, w.u2))]
        return w.h * abs(flux[0] - flux[1]) ** 2 / abs(w.e1 + w.e2)

    mesh, found = _patches(quilt), []
    while True:
        basis = skfem.Basis(mesh, skfem.ElementTriP2())
        values = np.array([complex(weight[what]) for what in quilt.at(mesh.p[:, mesh.t].mean(axis=1))])
        flat = basis.with_element(skfem.ElementTriP0())
        matrix = energy.assemble(basis, eps=flat.interpolate(values))
        x = np.zeros(basis.N, dtype=complex)
        held = [basis.get_dofs(_at(quilt, mesh, end)).all() for end in ends]
        x[held[1]] = 1.0
        x = skfem.solve(*skfem.condense(matrix, x=x, D=np.union1d(*held)))
        found.append(complex(x @ matrix @ x))
        if unknowns < basis.N:
            return found
        sides = [skfem.InteriorFacetBasis(mesh, skfem.ElementTriP2(), side=s) for s in (0, 1)]
        parts = {f"u{k + 1}": side.interpolate(x) for k, side in enumerate(sides)}
        parts |= {f"e{k + 1}": s.with_element(skfem.ElementTriP0()).interpolate(values) for k, s in enumerate(sides)}
        on_facets = np.zeros(mesh.facets.shape[1])
        on_facets[sides[0].find] = jump.elemental(sides[0], **parts).real
        share = on_facets[mesh.t2f].sum(axis=0)
        order = np.argsort(share)[::-1]
        most = np.searchsorted(np.cumsum(share[order]), 0.7 * share.sum()) + 1
        mesh = mesh.refined(order[:most])


def _patches(quilt: Quilt):
    """Every patch of dielectric in two triangles."""
    import skfem

    size = quilt.z_mm.shape[1]
    points = np.stack([np.repeat(quilt.x_mm, size), quilt.z_mm.ravel()])
    triangles = []
    for i, k in np.argwhere(~np.isin(quilt.fill, ENDS)):
        a, b = i * size + k, (i + 1) * size + k
        triangles += [(a, b, b + 1), (a, b + 1, a + 1)]
    used, corners = np.unique(np.array(triangles).T, return_inverse=True)
    return skfem.MeshTri(points[:, used], corners.reshape(3, -1))


def _at(quilt: Quilt, mesh, end: str) -> np.ndarray:
    """Sides of the mesh beyond which an electrode lies, or a mirror."""
    facets = mesh.boundary_facets()
    a, b = mesh.p[:, mesh.facets[0, facets]], mesh.p[:, mesh.facets[1, facets]]
    middle, along = (a + b) / 2, b - a
    away = np.stack([along[1], -along[0]])
    inside = mesh.p[:, mesh.t[:, mesh.f2t[0, facets]]].mean(axis=1)
    outside = middle + 1e-6 * away * np.sign((away * (middle - inside)).sum(axis=0))
    what = quilt.at(outside)
    what = np.where(outside[0] < 0, "left", np.where(outside[0] > quilt.x_mm[-1], "right", what))
    return facets[what == end]
