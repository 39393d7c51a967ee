r"""Tracks and films on top of each other: the double sensor, and a body that touches one.

n + 1 tracks and n films, from the bottom. With the film voltages v and loop currents i (out on the track above a film,
back on the track below it) v' = -R i and i' = -Y v, where Y is diagonal and neighbours share the track between them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.solvers import multiline
from sensorgen.solvers.line.inputs import check_fit, numbers, passive
from sensorgen.solvers.multiline import GroundTie, LineMatrices, Touch, diagonal, directions, inverse, loops

SOURCE = "Coupled lines (telegrapher's equations in matrices), joined as doubling does it for Riccati's equation"
COST = 0

Law = Callable[[Real], tuple[Real, Real]]


def impedance(
    r_ohm_per_m: Sequence[Sequence[ArrayLike]], y_s_per_m: Sequence[Sequence[ArrayLike]], length_m: Sequence[ArrayLike]
) -> Complex:
    r"""Voltages across the films at x = 0 by the loop currents there; the far end is open.

    .. math:: R = \begin{pmatrix} r_0 + r_1 & -r_1 \\ -r_1 & r_1 + r_2 \end{pmatrix}, \quad
              -\frac{dW}{dx} = Y - W R W, \quad Z = W^{-1}

    Parameters
    ----------
    r_ohm_per_m : sequence of sequences of float or array
        Section by section from the contacts, resistance of each track from the bottom [ohm/m]; 0 or more.
    y_s_per_m : sequence of sequences of float or array
        Admittance of each film [S/m] (complex), neither part below 0.
    length_m : sequence of float or array
        Length of each section [m].

    Returns
    -------
    complex array (..., n, n)
        Impedance [ohm]; inf + 0j in all places where some film carries no current anywhere.

    Raises
    ------
    OutOfRange
        A value that is not finite or below 0; numbers too extreme.
    BadInput
        Not one entry of each kind per section; something that is no number; shapes that do not broadcast.

    Notes
    -----
    Exact for uniform sections, no current spreading across the width, no fringe, no inductance. Entries broadcast.

    Examples
    --------
    Two films of 1 nF along three tracks of 9, 3 and 6 kohm, at a low frequency: a third of what a loop runs through,
    and, against it, of what two loops share.

    >>> y = 2j * np.pi * 1e-9
    >>> impedance([[9e3, 3e3, 6e3]], [[y, y]], [1.0]).real.round(3).tolist()
    [[4000.0, -1000.0], [-1000.0, 3000.0]]
    """
    return inverse(admittance(r_ohm_per_m, y_s_per_m, length_m))


def admittance(
    r_ohm_per_m: Sequence[Sequence[ArrayLike]], y_s_per_m: Sequence[Sequence[ArrayLike]], length_m: Sequence[ArrayLike]
) -> Complex:
    """The inverse of :func:`impedance` [S], which is finite always; parameters and errors are the same.

    >>> admittance([[0.0, 0.0]], [[1j]], [2.0]).tolist()
    [[2j]]
    """
    if not len(r_ohm_per_m) == len(y_s_per_m) == len(length_m):
        raise BadInput(
            f"{len(r_ohm_per_m)} resistances, {len(y_s_per_m)} admittances and {len(length_m)} lengths make no sections"
        )
    tracks = [multiline.side_by_side("resistance", section) for section in r_ohm_per_m]
    films = [multiline.side_by_side("admittance", section) for section in y_s_per_m]
    if any(r.shape[-1] != y.shape[-1] + 1 for r, y in zip(tracks, films, strict=True)):
        raise BadInput("a stack of n films has n + 1 tracks, in every section")
    lengths = [passive("length", length) for length in length_m]
    check_fit("the stack's values", [*lengths, *(section[..., 0] for section in (*tracks, *films))])
    lines = [LineMatrices(loops(r).astype(complex), diagonal(y)) for r, y in zip(tracks, films, strict=True)]
    return multiline.march(lines, lengths)[0]


def port(upper: int, lower: int, films: int) -> Real:
    """Films that a port between two tracks spans, as a vector; ``p @ z @ q`` is an impedance between ports [-].

    Parameters
    ----------
    upper, lower : int
        Tracks, counted from 0 at the bottom.
    films : int
        How many films the stack has.

    Raises
    ------
    OutOfRange
        No such tracks, or the same one twice.

    Examples
    --------
    >>> port(2, 0, 2), port(1, 0, 2)
    (array([1., 1.]), array([1., 0.]))
    """
    if not 0 <= lower < upper <= films:
        raise OutOfRange(
            f"no port between tracks {upper} and {lower} of {films + 1}: expected an upper and a lower one"
        )
    return np.array([float(lower <= k < upper) for k in range(films)])


class Track(NamedTuple):
    """An electrode: resistance per length [ohm/m], and its relative rise per pressure under the tip [1/Pa]."""

    r_ohm_per_m: float
    piezoresistance_per_pa: float = 0.0


class Film(NamedTuple):
    """A film between two tracks.

    Attributes
    ----------
    capacitance_f_per_m : float
        Unloaded, per length [F/m].
    capacitive_strain : callable
        Pressure [Pa] to capacitive strain [-] and its derivative [1/Pa], as
        :meth:`sensorgen.models.compression.Plate.capacitive_strain`.
    tan_delta : float
        Loss tangent [-].
    leak_s_per_m : float
        Leak per length, the same under the tip [S/m].
    """

    capacitance_f_per_m: float
    capacitive_strain: Law
    tan_delta: float = 0.0
    leak_s_per_m: float = 0.0

    def y_s_per_m(self, omega: Real) -> Complex:
        """Admittance per length, unloaded, at an angular frequency [1/s]."""
        return np.asarray(self.leak_s_per_m + _turned(self, omega))


class Press(NamedTuple):
    """A tip across the whole width; every film carries its force (they lie in series). Arrays broadcast."""

    force_n: ArrayLike = 0.0
    left_m: ArrayLike = 0.0
    length_m: ArrayLike = 0.01


class StackResponse(NamedTuple):
    """Impedance matrix and its derivatives, each (..., n, n)."""

    impedance_ohm: Complex
    by_force_ohm_per_n: Complex
    by_position_ohm_per_m: Complex
    by_film_ohm: tuple[Complex, ...]
    """By the logarithm of each film's capacitance, pressed or not: what a drift of its permittivity does [ohm]."""


@dataclass(frozen=True)
class Stack:
    """n + 1 tracks and n films from the bottom, contacts at x = 0, the far end open.

    Attributes
    ----------
    length_m, width_m : float
        Outline [m].
    tracks, films : tuple of Track, tuple of Film
        From the bottom.

    Examples
    --------
    >>> from sensorgen.models.compression import unconfined
    >>> film = Film(69e-11, unconfined(6e6).capacitive_strain)
    >>> double = Stack(0.1, 0.01, (Track(45e3),) * 3, (film, film))
    >>> z = double.response(99.7e3, Press(6.0, 0.04, 0.01))
    >>> [round(abs(complex(m)), 2) for m in z.by_force_ohm_per_n.diagonal()]
    [3.93, 3.93]
    """

    length_m: float
    width_m: float
    tracks: tuple[Track, ...]
    films: tuple[Film, ...]

    def __post_init__(self) -> None:
        """Refuse a stack without a film, or with tracks that do not fit."""
        if not self.films or len(self.tracks) != len(self.films) + 1:
            raise OutOfRange(
                f"{len(self.tracks)} tracks and {len(self.films)} films: expected one track more than films"
            )

    def impedance(self, frequency_hz: ArrayLike, press: Press = Press()) -> Complex:  # noqa: B008 - immutable
        """Impedance matrix [ohm]; as :meth:`response`, but also where it is infinite."""
        return impedance(*self.sections(frequency_hz, press))

    def touched(
        self,
        frequency_hz: ArrayLike,
        touch: Touch,
        body: GroundTie,
        driven: int,
        low: int,
        bridge: bool = True,
    ) -> Complex:
        """Impedance that an instrument reads between two tracks while a body touches the top [ohm].

        Parameters
        ----------
        frequency_hz : float or array
            Frequencies, above 0 [Hz].
        touch, body : Touch, GroundTie
            Where and through what it touches; how it is tied to the ground of the instrument.
        driven, low : int
            Track that the instrument drives, and track that it holds at ground, counted from 0 at the bottom.
        bridge : bool
            Whether only the current that arrives at ``low`` is measured (auto-balancing bridge, as in thesis Figure
            5.10), or all that is driven.

        Raises
        ------
        OutOfRange
            As :meth:`sections`; also at frequency 0, or where isolation or body have nothing to couple with.
        """
        if not (np.min(frequency_hz) > 0 and touch.isolation_f_per_m > 0 and min(body) > 0):
            raise OutOfRange("a touch needs a frequency, an isolation's capacitance and a body, all above 0")
        r, y, lengths = self.sections(frequency_hz, Press(touch.force_n, touch.left_m, touch.length_m))
        # The body is a track without resistance, coupled under the touch alone
        touching = touch.admittance_s_per_m(frequency_hz, body)
        r, y = [[*section, 0.0] for section in r], [[*section, touching * (k == 1)] for k, section in enumerate(y)]
        n = len(self.films) + 1
        across = port(driven, low, n) if driven > low else -port(low, driven, n)
        return multiline.reading(
            admittance(r, y, lengths), across, port(n, low, n), body.admittance_s(frequency_hz), bridge
        )

    def sections(self, frequency_hz: ArrayLike, press: Press) -> tuple[list[Any], list[Any], list[Any]]:
        """Resistances, admittances and lengths left of the tip, under it, and right of it.

        Raises
        ------
        OutOfRange
            A tip beyond the stack, a stress that its films' laws refuse, or a frequency below 0.
        BadInput
            Something that is no number; shapes that do not broadcast.
        """
        omega = 2 * np.pi * passive("frequency", frequency_hz)
        force, left, length = (numbers(*given) for given in zip(("force", "left edge", "length"), press, strict=True))
        check_fit("frequency and press", [omega, force, left, length])
        if not np.isfinite(force).all():
            raise OutOfRange("a force is not finite; expected a number")
        right = self.length_m - left - length
        if not ((left >= 0) & (length > 0) & (right >= -1e-12 * self.length_m)).all():
            raise OutOfRange(f"the tip does not lie within the stack of {self.length_m * 1e3:g} mm")
        away, loose = [track.r_ohm_per_m for track in self.tracks], [film.y_s_per_m(omega) for film in self.films]
        risen, denser = self._changes(omega, press)
        under = [r + more for r, more in zip(away, risen, strict=True)]
        pressed = [y + more for y, more in zip(loose, denser, strict=True)]
        return [away, under, away], [loose, pressed, loose], [left, length, np.maximum(right, 0.0)]

    def _changes(self, omega: Real, press: Press) -> tuple[list[Any], list[Any]]:
        """Additions of pressing to each track and each film, exactly 0 without force."""
        stress = np.asarray(press.force_n, float) / (self.width_m * np.asarray(press.length_m, float))
        thinner = [film.capacitive_strain(stress)[0] for film in self.films]
        denser = [_turned(film, omega) * (s / (1 - s)) for film, s in zip(self.films, thinner, strict=True)]
        return [track.r_ohm_per_m * track.piezoresistance_per_pa * stress for track in self.tracks], denser

    def response(self, frequency_hz: ArrayLike, press: Press) -> StackResponse:
        r"""Impedance matrix and its exact derivatives.

        A direction in which R and Y move is passed on through doubling and joining. By position, the patch moves as if
        its equations were tilted: v' = A v - R i, i' = -Y v - A^T i with

        .. math:: A = R_p Y_0 - R_0 Y_p,

        so that nothing cancels, and without a change of characteristic impedance there is exactly no trace of position.

        Parameters
        ----------
        frequency_hz : float or array
            Frequencies, above 0 [Hz].
        press : Press
            What presses, and where; the derivative by position is by ``left_m``.

        Raises
        ------
        OutOfRange
            As :meth:`sections`; also where the impedance is infinite.
        """
        r, y, given = self.sections(frequency_hz, press)
        series = [loops(multiline.side_by_side("resistance", section)).astype(complex) for section in r]
        shunt = [diagonal(multiline.side_by_side("admittance", section)) for section in y]
        lengths = [passive("length", length) for length in given]
        deep = max(*(m.ndim for m in (*series, *shunt)), *(length.ndim + 2 for length in lengths))
        drifts = [[self._by_film(section, k) for k in range(len(self.films))] for section in y]
        lines = [
            LineMatrices(s, d, by_shunt=directions(deep, 0.0, 0.0, *drift))
            for s, d, drift in zip(series, shunt, drifts, strict=True)
        ]
        omega = 2 * np.pi * np.asarray(frequency_hz, float)
        by_series, by_shunt = self._by_force(omega, press)
        risen, denser = self._changes(omega, press)
        tilt = loops(_last(risen)) @ shunt[0] - series[0] @ diagonal(_last(denser))  # R_p Y_0 - R_0 Y_p
        still = len(self.films) * [0.0]
        lines[1] = LineMatrices(
            series[1], shunt[1], directions(deep, by_series, 0.0, *still), directions(deep, by_shunt, 0.0, *drifts[1]),
            directions(deep, 0.0, tilt, *still),
        )  # fmt: skip
        w, by = multiline.march(lines, lengths)
        z = inverse(w)
        if not np.isfinite(z).all():
            raise OutOfRange("no derivative where the impedance is infinite: give a frequency above 0")
        by_force, by_position, *by_film = np.broadcast_to(
            -z @ by @ z, (by.shape[0], *np.broadcast_shapes(z.shape, by.shape[1:]))
        )
        return StackResponse(np.broadcast_to(z, by_force.shape), by_force, by_position, tuple(by_film))

    def _by_force(self, omega: Real, press: Press) -> tuple[Complex, Complex]:
        """Rise of R and Y under the tip per newton."""
        area = self.width_m * np.asarray(press.length_m, float)
        rise = [track.r_ohm_per_m * track.piezoresistance_per_pa / area for track in self.tracks]
        stress = np.asarray(press.force_n, float) / area
        thinner = [film.capacitive_strain(stress) for film in self.films]
        slopes = [
            _turned(film, omega) / (1 - share) ** 2 * slope / area
            for film, (share, slope) in zip(self.films, thinner, strict=True)
        ]
        return loops(_last(rise)).astype(complex), diagonal(_last(slopes))

    def _by_film(self, y: Sequence[ArrayLike], which: int) -> Complex:
        """Rise of Y with the logarithm of one film's capacitance."""
        changes = [
            (np.asarray(value) - film.leak_s_per_m) * (k == which)
            for k, (value, film) in enumerate(zip(y, self.films, strict=True))
        ]
        return diagonal(_last(changes))


def _turned(film: Film, omega: Real) -> Complex:
    return np.asarray((film.tan_delta + 1j) * omega * film.capacitance_f_per_m)


def _last(values: Sequence[ArrayLike]) -> NDArray[Any]:
    return np.stack(np.broadcast_arrays(*values), axis=-1)
