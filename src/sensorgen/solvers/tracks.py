r"""Rows of resistive tracks that cross columns at capacitors, read at one end of each: currents, and their slopes.

Nodes: one of a row and one of a column at every crossing. With A the matrix of their admittances and e_t the node at
which terminal t is connected, the voltage across crossing k for 1 A into t is :math:`U_{kt} = d_k^T A^{-1} e_t`. A is
symmetric: the slope of any :math:`e_s^T A^{-1} e_t` by the admittance of k is :math:`-U_{ks} U_{kt}` (adjoint). U has
(crossings x terminals) entries, and the slopes of all readings are products of two of them: no matrix of
(readings x crossings) is needed.

A is eliminated in blocks of one row (block tridiagonal by rows, as columns join neighbouring rows only); the shorter
side of the array is taken for the block.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sensorgen.core.arrays import Complex, Real, Whole
from sensorgen.core.errors import BadInput, OutOfRange

Readout = Literal["guarded", "two-terminal"]
READOUTS: tuple[Readout, ...] = ("guarded", "two-terminal")


@dataclass(frozen=True, eq=False)
class Tracks:
    """Network of m rows and n columns.

    Attributes
    ----------
    capacitance_f : (m, n) array
        Of each crossing; 0 where rows and columns do not cross [F].
    row_ohm : (m, n - 1) array
        Of each row between neighbouring columns, > 0; infinite where it is broken [ohm].
    column_ohm : (m - 1, n) array
        Of each column between neighbouring rows, > 0; infinite where it is broken [ohm].
    row_lead_ohm, column_lead_ohm : (m,), (n,) array
        Between the terminal of a track and the crossing nearest to it; infinite where it is broken [ohm].
    row_end, column_end : (m,), (n,) array of int
        Column, and row, at which the lead of each track ends.
    tan_delta : float
        Loss of the crossings [-].
    leak_s : (m, n) array
        Conductance beside each crossing, as of a short [S].
    """

    capacitance_f: Real
    row_ohm: Real
    column_ohm: Real
    row_lead_ohm: Real
    column_lead_ohm: Real
    row_end: Whole
    column_end: Whole
    tan_delta: float
    leak_s: Real

    def __post_init__(self) -> None:
        """Refuse values that no network has."""
        m, n = self.capacitance_f.shape
        shapes = {"row_ohm": (m, n - 1), "column_ohm": (m - 1, n), "row_lead_ohm": (m,), "column_lead_ohm": (n,),
                  "row_end": (m,), "column_end": (n,), "leak_s": (m, n)}  # fmt: skip
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise BadInput(f"{name} is {getattr(self, name).shape}; expected {shape} for {m} rows, {n} columns")
        if not (self.row_ohm > 0).all() or not (self.column_ohm > 0).all():
            raise OutOfRange("resistance between two crossings: expected above 0 ohm")
        for name in ("capacitance_f", "leak_s", "row_lead_ohm", "column_lead_ohm"):
            if not (getattr(self, name) >= 0).all():
                raise OutOfRange(f"{name}: expected 0 or more everywhere")

    @classmethod
    def uniform(
        cls, capacitance_f: Real, *, row_ohm: float, column_ohm: float, lead_ohm: float = 0.0, tan_delta: float = 0.0
    ) -> "Tracks":
        """Tracks with the same resistance between all crossings [ohm], read beside column 0 and row 0."""
        m, n = capacitance_f.shape
        return cls(
            capacitance_f, np.full((m, n - 1), row_ohm), np.full((m - 1, n), column_ohm), np.full(m, lead_ohm),
            np.full(n, lead_ohm), np.zeros(m, dtype=np.int64), np.zeros(n, dtype=np.int64), tan_delta, np.zeros((m, n)),
        )  # fmt: skip

    def broken(self, side: Literal["row", "column"], track: int, after: int) -> "Tracks":
        """Tracks with one of them broken behind its crossing ``after``; -1 breaks the lead at crossing 0."""
        at: tuple[int, ...] = (track, after) if side == "row" else (after, track)
        name = f"{side}_ohm"
        if after < 0:
            name, at = f"{side}_lead_ohm", (track,)
        ohm = getattr(self, name).copy()
        if not all(0 <= index < size for index, size in zip(at, ohm.shape, strict=True)):
            raise OutOfRange(f"{side} {track} has no stretch after crossing {after}")
        ohm[at] = np.inf
        return replace(self, **{name: ohm})

    def shorted(self, row: int, column: int, ohm: float) -> "Tracks":
        """Tracks with a resistance beside one crossing [ohm]."""
        leak = self.leak_s.copy()
        leak[row, column] += 1 / ohm
        return replace(self, leak_s=leak)

    def turned(self) -> "Tracks":
        """Tracks with rows and columns exchanged."""
        return Tracks(
            self.capacitance_f.T, self.column_ohm.T, self.row_ohm.T, self.column_lead_ohm, self.row_lead_ohm,
            self.column_end, self.row_end, self.tan_delta, self.leak_s.T,
        )  # fmt: skip

    def per_farad(self, frequency_hz: float) -> complex:
        """Admittance of a crossing per capacitance [S/F]."""
        return 2j * np.pi * frequency_hz * (1 - 1j * self.tan_delta)


@dataclass(frozen=True, eq=False)
class CrossingReadings:
    """Readings of all crossings, and their slopes by the capacitance of every crossing.

    Attributes
    ----------
    siemens : (m, n) array
        Guarded: current into column j per volt that drives row i. Two terminals: admittance between both [S].
    by_row, by_column : (m, n, m), (m, n, n) array
        Voltage across each crossing for 1 A into the node of each terminal [ohm].
    factor : (m, n) array
        ``guarded``: product of both terminals' conductances; ``two-terminal``: square of the reading [S2].
    per_farad : complex
        Admittance of a crossing per capacitance [S/F].
    readout : str
        One of ``READOUTS``.
    """

    siemens: Complex
    by_row: Complex
    by_column: Complex
    factor: Complex
    per_farad: complex
    readout: Readout

    def change(self, capacitance_f: Real) -> Complex:
        """First-order change of all readings with a change of all capacitances, (m, n) [S]."""
        u, v = self._flat()
        x = np.ravel(capacitance_f).astype(complex)[:, None]
        mixed = u.T @ (x * v)
        if self.readout == "guarded":
            return np.asarray(-self.factor * self.per_farad * mixed)
        square = (u**2 * x).sum(0)[:, None] + (v**2 * x).sum(0)
        return np.asarray(self.factor * self.per_farad * (square - 2 * mixed))

    def gradient(self, weight: Complex) -> Complex:
        """Slopes by the capacitance of each crossing of the sum of all readings by weight, (m, n) [S/F]."""
        u, v = self._flat()
        w = np.asarray(weight) * self.factor * self.per_farad
        mixed = np.einsum("kj,kj->k", u @ w, v)
        if self.readout == "guarded":
            return np.asarray(-mixed.reshape(self.siemens.shape))
        return np.asarray((u**2 @ w.sum(1) + v**2 @ w.sum(0) - 2 * mixed).reshape(self.siemens.shape))

    def slopes(self, row: int, column: int) -> Complex:
        """Slopes of one reading by the capacitance of each crossing, (m, n) [S/F]."""
        product = self._products(self.by_row[:, :, row], self.by_column[:, :, column])
        return np.asarray(self.factor[row, column] * self.per_farad * product)

    def own_slopes(self) -> Complex:
        """Slope of each reading by the capacitance of its own crossing, (m, n) [S/F]."""
        i, j = np.indices(self.siemens.shape)
        return np.asarray(self.factor * self.per_farad * self._products(self.by_row[i, j, i], self.by_column[i, j, j]))

    def matrix(self) -> Complex:
        """Slopes of all readings by all capacitances, (m n, m n): as large as the square of the crossings [S/F]."""
        m, n = self.siemens.shape
        u, v = self._flat()
        return np.asarray(
            (self._products(u[:, :, None], v[:, None, :]) * (self.factor * self.per_farad)).reshape(m * n, m * n).T
        )

    def _products(self, u: Complex, v: Complex) -> Complex:
        """Change of a reading with a crossing's admittance over its factor, by the voltages across the crossing."""
        return -u * v if self.readout == "guarded" else (u - v) ** 2

    def _flat(self) -> tuple[Complex, Complex]:
        m, n = self.siemens.shape
        return self.by_row.reshape(m * n, m), self.by_column.reshape(m * n, n)

    def turned(self) -> "CrossingReadings":
        """Readings with rows and columns exchanged."""
        by_row, by_column = (np.swapaxes(each, 0, 1) for each in (self.by_column, self.by_row))
        return replace(self, siemens=self.siemens.T, factor=self.factor.T, by_row=by_row, by_column=by_column)


def readings(
    tracks: Tracks, frequency_hz: float, *, readout: Readout = "guarded", input_ohm: float = 50.0
) -> CrossingReadings:
    """Readings of all crossings of a network at one frequency.

    Parameters
    ----------
    tracks : Tracks
        The network.
    frequency_hz : float
        Of the drive [Hz], > 0.
    readout : str
        "guarded": one row is driven by 1 V through ``input_ohm``, all other rows and the columns are at 0 V through it.
        "two-terminal": the meter lies between a row and a column, all other terminals are open.
    input_ohm : float
        Of each terminal, guarded [ohm], > 0.

    Raises
    ------
    OutOfRange
        A frequency or an input resistance that is not above 0.

    Notes
    -----
    Nodal analysis; crossings without extent, no inductance, no capacitance between neighbouring tracks.

    Examples
    --------
    >>> one = readings(Tracks.uniform(np.array([[1e-11]]), row_ohm=1.0, column_ohm=1.0), 1e4, input_ohm=1e-3)
    >>> round(float(one.siemens[0, 0].imag) * 1e9, 3)  # 2 pi f C, nS
    628.319
    """
    if not 0 < frequency_hz < np.inf:
        raise OutOfRange(f"frequency {frequency_hz:g} Hz; expected above 0")
    if readout not in READOUTS:
        raise BadInput(f"readout {readout!r}; expected {' or '.join(READOUTS)}")
    if readout == "guarded" and not 0 < input_ohm < np.inf:
        raise OutOfRange(f"input resistance {input_ohm:g} ohm; expected above 0")
    m, n = tracks.capacitance_f.shape
    if n > m:
        return readings(tracks.turned(), frequency_hz, readout=readout, input_ohm=input_ohm).turned()
    per_farad = tracks.per_farad(frequency_hz)
    y: Complex = np.asarray(tracks.capacitance_f * per_farad + tracks.leak_s)
    lead = np.concatenate([tracks.row_lead_ohm, tracks.column_lead_ohm])
    row, column = slice(None, m), slice(m, None)
    if readout == "guarded":
        ground, _ = _ground(tracks, y, 1 / (lead + input_ohm))
        across, z = _solved(tracks, y, ground)
        factor = np.outer(1 / (lead[row] + input_ohm), 1 / (lead[column] + input_ohm)).astype(complex)
        return CrossingReadings(
            factor * z[row, column], across[:, :, row], across[:, :, column], factor, per_farad, readout
        )
    ohm = _middle_ohm(tracks)
    ground, label = _ground(tracks, y, np.full(m + n, 1 / ohm))
    across, z = _solved(tracks, y, ground)
    floating = _floating(z / ohm**2, label)
    across = across @ (floating / ohm)
    own = np.diag(floating) + lead - ohm
    between = own[row, None] + own[None, column] - 2 * floating[row, column]
    connected = (label[row, None] == label[None, column]) & np.isfinite(between)
    value = np.where(connected, 1 / np.where(connected, between, 1), 0)
    return CrossingReadings(value, across[:, :, row], across[:, :, column], value**2, per_farad, readout)


def _middle_ohm(tracks: Tracks) -> float:
    """Median resistance of the stretches; of one crossing alone 1 ohm [ohm]."""
    ohm = np.concatenate([each[np.isfinite(each)] for each in (tracks.row_ohm, tracks.column_ohm)])
    return float(np.median(ohm)) if len(ohm) else 1.0


def _floating(current_s: Complex, label: Whole) -> Complex:
    """Impedances between terminals that are open, by currents between terminals at 0 V: first of a group is reference.

    Currents at 0 V have no cancellation, and what flows into all others is what flows out of one: so the impedances
    keep their digits, however little the crossings conduct beside the tracks.
    """
    laplacian = -current_s
    np.fill_diagonal(laplacian, 0.0)
    np.fill_diagonal(laplacian, -laplacian.sum(0))
    first = np.unique(label, return_index=True)[1]
    laplacian[first] = laplacian[:, first] = 0.0
    laplacian[first, first] = 1.0
    inverse = np.linalg.inv(laplacian)
    inverse[first, first] = 0.0
    return np.asarray(inverse)


def _ground(tracks: Tracks, y: Complex, terminal_s: Real) -> tuple[Complex, Whole]:
    """Conductance from every node to ground, (2, m, n) [S], and the connected group of every terminal.

    Of a group that no terminal grounds one node is: no current flows there.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    m, n = y.shape
    node = np.arange(2 * m * n).reshape(2, m, n)
    ends = np.concatenate([node[0][np.arange(m), tracks.row_end], node[1][tracks.column_end, np.arange(n)]])
    ground = np.zeros(2 * m * n)
    np.add.at(ground, ends, terminal_s)
    joined = [np.isfinite(tracks.row_ohm), np.isfinite(tracks.column_ohm), y != 0]
    pairs = (node[0, :, :-1], node[0, :, 1:]), (node[1, :-1], node[1, 1:]), (node[0], node[1])
    one, other = (np.concatenate([pair[k][is_on] for pair, is_on in zip(pairs, joined, strict=True)]) for k in (0, 1))
    links = coo_array((np.ones(len(one)), (one, other)), shape=(2 * m * n, 2 * m * n))
    label = np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)
    floating = np.bincount(label, ground) == 0
    first = np.unique(label, return_index=True)[1]
    ground[first[floating]] = 1 / _middle_ohm(tracks)
    return ground.reshape(2, m, n).astype(complex), label[ends]


def _solved(tracks: Tracks, y: Complex, ground: Complex) -> tuple[Complex, Complex]:
    """Voltage across each crossing for 1 A into each terminal, (m, n, m + n), and impedances of the terminals [ohm].

    Row i has nodes r_i, columns have c_i at it. M_i is the inverse of the row's own matrix, r_i = M_i (b_i + y_i c_i).
    What is left is tridiagonal in blocks: K_i c_i - G_(i-1) c_(i-1) - G_i c_(i+1) = f_i, K_i = D_i + y_i - y_i M_i y_i.
    """
    m, n = y.shape
    at = np.arange(n)
    g_row = np.zeros((m, n + 1))
    g_row[:, 1:-1] = 1 / tracks.row_ohm
    g_column = np.zeros((m + 1, n))
    g_column[1:-1] = 1 / tracks.column_ohm
    own = np.zeros((m, n, n), complex)
    own[:, at, at] = g_row[:, :-1] + g_row[:, 1:] + ground[0] + y
    own[:, at[1:], at[:-1]] = own[:, at[:-1], at[1:]] = -g_row[:, 1:-1]
    inverse = np.linalg.inv(own)
    left = -y[:, :, None] * inverse * y[:, None, :]
    left[:, at, at] += g_column[:-1] + g_column[1:] + ground[1] + y

    sides = np.zeros((m, n, m + n), complex)
    driven = inverse[np.arange(m), :, tracks.row_end]  # potentials of a row for 1 A into its terminal, columns at 0
    sides[np.arange(m), :, np.arange(m)] = y * driven
    sides[tracks.column_end, at, m + at] = 1.0
    factor = np.empty_like(left)
    for i in range(m):
        if i:
            g = g_column[i]
            left[i] -= g[:, None] * factor[i - 1] * g
            sides[i] += g[:, None] * (factor[i - 1] @ sides[i - 1])
        factor[i] = np.linalg.inv(left[i])
    columns = np.empty_like(sides)
    for i in range(m)[::-1]:
        right = sides[i] + (g_column[i + 1][:, None] * columns[i + 1] if i + 1 < m else 0)
        columns[i] = factor[i] @ right
    rows = inverse @ (y[:, :, None] * columns)
    rows[np.arange(m), :, np.arange(m)] += driven
    z = np.concatenate([rows[np.arange(m), tracks.row_end], columns[tracks.column_end, at]])
    return rows - columns, z
