"""Impedance between contacts of a network, exact derivatives included, without loss towards direct current."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.solvers.sheet.grid import Axis
from sensorgen.solvers.sheet.links import Index, Links, Real
from sensorgen.solvers.sheet.parts import SIDES, Contact, Port, Sheet

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Network:
    """Nodes merged where a conductor joins them; both sheets have a node of reference, which is no unknown.

    Attributes
    ----------
    ends : (2, n) array
        Unknown at both ends of each link, -1 at a reference.
    film : slice
        The links through the film, from top to bottom.
    drive : (unknowns, ports) array
        Current into each unknown for 1 A through each port [-].
    crossing : (ports,) array
        What of that 1 A goes from the top to the bottom sheet: 1, -1, or 0 between contacts of one sheet.
    """

    ends: Index
    film: slice
    drive: Real
    crossing: Real

    def solve(self, admittance_s: Complex) -> tuple[Complex, Complex]:
        r"""Impedance matrix [ohm], and the voltage along each link for 1 A through each port.

        The voltage alpha between the references and the voltages w to them, h = S^-1 g per volt of alpha, obey

        .. math:: S w + \alpha g = b, \quad g^T w + \alpha Y = c, \quad
                  Z_{pq} = \alpha_p \alpha_q (Y - g^T h) + b_p^T S^{-1} b_q

        S has no small eigenvalue however little the film conducts, so that Re Z keeps all its digits, and no current
        through the film is a case like any other: alpha is then infinite, or nothing for ports within one sheet.
        """
        y = admittance_s[self.film]
        border = self._gather(y, self.film)
        solved = self._inverse(admittance_s, np.column_stack([self.drive, border]))
        w, h = solved[:, :-1], solved[:, -1]
        through = self.crossing - border @ w
        total = y.sum() - border @ h
        if total == 0:
            alpha, z = np.zeros(len(self.crossing)), self.drive.T @ w
            z[np.outer(self.crossing, self.crossing) != 0] = complex(np.inf, 0.0)
        else:
            alpha = through / total
            z = np.outer(alpha, through) + self.drive.T @ w
        along = self._differences(w - np.outer(h, alpha))
        along[self.film] += alpha
        return z, along

    def _gather(self, y: Complex, part: slice) -> Complex:
        """Sum over the film's links at their top, minus that at their bottom, per unknown."""
        a, b = self.ends[:, part]
        size = len(self.drive)
        found = np.zeros(size + 1, complex)  # the last takes what belongs to a reference
        np.add.at(found, a, y)
        np.add.at(found, b, -y)
        return found[:size]

    def _differences(self, potentials: Complex) -> Complex:
        padded = np.vstack([potentials, np.zeros((1, potentials.shape[1]))])
        return np.asarray(padded[self.ends[0]] - padded[self.ends[1]])

    def _inverse(self, admittance_s: Complex, right: Complex) -> Complex:
        if not len(right):
            return right
        from scipy.sparse import csc_matrix
        from scipy.sparse.linalg import splu

        a, b = self.ends
        inner = (a >= 0) & (b >= 0) & (a != b)
        at_a, at_b = (a >= 0) & (a != b), (b >= 0) & (a != b)
        y = admittance_s
        rows = np.concatenate([a[at_a], b[at_b], a[inner], b[inner]])
        columns = np.concatenate([a[at_a], b[at_b], b[inner], a[inner]])
        values = np.concatenate([y[at_a], y[at_b], -y[inner], -y[inner]])
        matrix = csc_matrix((values, (rows, columns)), shape=(len(right), len(right)))
        factors: Any = splu(
            matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True, "Equil": False}
        )
        return np.asarray(factors.solve(right))


def network(
    sheet: Sheet, axes: tuple[Axis, Axis], contacts: Sequence[Contact], ports: Sequence[Port], of: Links
) -> Network:
    """Merge nodes under contacts and on perfectly conducting sheets, and number what is left."""
    count = 2 * len(axes[0].lines_m) * len(axes[1].lines_m)
    joined = np.arange(count)
    places = {contact: _nodes(axes, contact) for contact in contacts}
    for nodes in places.values():
        joined[nodes] = nodes[0]
    for side, ohm in enumerate(sheet.sheet_resistance_ohm):
        if ohm == 0:
            joined[side::2] = side
    first = {side: _reference(side, contacts, places) for side in range(2)}
    kept, label = np.unique(joined, return_inverse=True)
    references = label[[first[0], first[1]]]
    number = np.full(len(kept), -1)
    free = np.setdiff1d(np.arange(len(kept)), references)
    number[free] = np.arange(len(free))
    unknown = number[label]

    drive, crossing = np.zeros((len(free) + 1, len(ports))), np.zeros(len(ports))
    for p, port in enumerate(ports):
        for contact, sign in zip(port, (1.0, -1.0), strict=True):
            drive[unknown[places[contact][0]], p] += sign
            crossing[p] += sign * (contact.side == SIDES[0])
    return Network(unknown[of.ends], slice(of.ends.shape[1] - count // 2, None), drive[:-1], crossing)


def _nodes(axes: tuple[Axis, Axis], contact: Contact) -> Index:
    x, y = axes[0].nodes(*contact.x_m), axes[1].nodes(*contact.y_m)
    return np.asarray(2 * (x[:, None] * len(axes[1].lines_m) + y).ravel() + SIDES.index(contact.side))


def _reference(side: int, contacts: Sequence[Contact], places: dict[Contact, Index]) -> int:
    """A node under a contact of that sheet, or its first node where it has none."""
    return next((int(places[c][0]) for c in contacts if c.side == SIDES[side]), side)
